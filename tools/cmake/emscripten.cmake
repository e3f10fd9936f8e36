# Toolchain file of the preset `wasm`: Debian's emscripten (clang 14).
#
# Eigen, toml++ and nlohmann/json are headers of the machine. Its /usr/include as a whole would bring
# the wrong C library, so that a folder of links holds these alone.
find_program(emcc emcc NO_CACHE)
if(NOT emcc)
    message(FATAL_ERROR "missing: emscripten\nRun tools/zh site, which installs it, or install from Debian: emscripten")
endif()
file(GLOB zh_emscripten LIST_DIRECTORIES false /usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
     "$ENV{EMSDK}/upstream/emscripten/cmake/Modules/Platform/Emscripten.cmake")
list(GET zh_emscripten 0 zh_emscripten)
include("${zh_emscripten}")

set(headers "${CMAKE_BINARY_DIR}/machine_headers")
foreach(folder IN ITEMS toml++ nlohmann)
    if(EXISTS "/usr/include/${folder}" AND NOT EXISTS "${headers}/${folder}")
        file(MAKE_DIRECTORY "${headers}")
        file(CREATE_LINK "/usr/include/${folder}" "${headers}/${folder}" SYMBOLIC)
    endif()
endforeach()
set(ZH_TOMLPLUSPLUS_DIR "${headers}" CACHE PATH "Folder with toml++")
set(ZH_NLOHMANN_DIR "${headers}" CACHE PATH "Folder with nlohmann")
set(Eigen3_DIR /usr/share/eigen3/cmake CACHE PATH "Folder with Eigen3Config.cmake")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

# C++ exceptions of the engine's own: they cost nothing while nobody throws.
set(CMAKE_CXX_FLAGS_INIT "-fwasm-exceptions -include ${CMAKE_CURRENT_LIST_DIR}/libcxx_of_clang_14.hpp")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-fwasm-exceptions")
