# Target `unity`: the Unity test framework, from the first of
#   1. -DUNITY_DIR=<folder with unity.c>
#   2. .cache/unity, which tools/zh fills from the Debian archive (verified there); the build keeps a
#      copy, so that it needs neither .cache nor a network again
#   3. the upstream tag, when a network is at hand
set(UNITY_DIR "" CACHE PATH "Folder with unity.c and unity.h; empty: look in .cache/unity, then download")
set(ZH_UNITY_DIR "${UNITY_DIR}")
if(NOT ZH_UNITY_DIR AND EXISTS "${CMAKE_SOURCE_DIR}/.cache/unity/unity.c")
    file(COPY "${CMAKE_SOURCE_DIR}/.cache/unity" DESTINATION "${CMAKE_BINARY_DIR}")
endif()
if(NOT ZH_UNITY_DIR AND EXISTS "${CMAKE_BINARY_DIR}/unity/unity.c")
    set(ZH_UNITY_DIR "${CMAKE_BINARY_DIR}/unity")
endif()
if(NOT ZH_UNITY_DIR)
    include(FetchContent)
    FetchContent_Declare(
        unity_upstream
        GIT_REPOSITORY https://github.com/ThrowTheSwitch/Unity.git
        GIT_TAG v2.5.2
        GIT_SHALLOW ON
        SOURCE_SUBDIR no-build-of-its-own)
    message(STATUS "Unity: not at hand, downloading (tools/zh test takes it from Debian instead)")
    FetchContent_MakeAvailable(unity_upstream)
    set(ZH_UNITY_DIR "${unity_upstream_SOURCE_DIR}/src")
endif()
if(NOT EXISTS "${ZH_UNITY_DIR}/unity.c")
    message(FATAL_ERROR "UNITY_DIR: no unity.c in '${ZH_UNITY_DIR}'; give the folder that holds it")
endif()

add_library(unity STATIC "${ZH_UNITY_DIR}/unity.c")
target_include_directories(unity SYSTEM PUBLIC "${ZH_UNITY_DIR}")
# The reference values of the tests are double precision.
target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE)
