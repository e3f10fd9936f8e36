# Target `unity`, the Unity test framework, when unity.c is in ZH_UNITY_DIR:
#   1. -DUNITY_DIR=<folder with unity.c>, or that variable of the environment
#   2. .cache/unity, which tools/zh fills from the Debian archive (verified there); the build keeps a
#      copy, so that it needs neither .cache nor a network again
set(UNITY_DIR "$ENV{UNITY_DIR}" CACHE PATH "Folder with unity.c and unity.h; empty: .cache/unity")
set(ZH_UNITY_DIR "${UNITY_DIR}")
if(NOT ZH_UNITY_DIR)
    set(ZH_UNITY_DIR "${PROJECT_SOURCE_DIR}/.cache/unity")
    if(EXISTS "${ZH_UNITY_DIR}/unity.c")
        file(COPY "${ZH_UNITY_DIR}" DESTINATION "${PROJECT_BINARY_DIR}")
    endif()
    if(EXISTS "${PROJECT_BINARY_DIR}/unity/unity.c")
        set(ZH_UNITY_DIR "${PROJECT_BINARY_DIR}/unity")
    endif()
endif()

if(EXISTS "${ZH_UNITY_DIR}/unity.c")
    add_library(unity STATIC "${ZH_UNITY_DIR}/unity.c")
    target_include_directories(unity SYSTEM PUBLIC "${ZH_UNITY_DIR}")
    # The reference values of the tests are double precision.
    target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE)
endif()
