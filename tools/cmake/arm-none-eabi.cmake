# Toolchain: Cortex-M4F with single-precision FPU, bare metal, newlib for memcpy and memset alone.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
find_program(ZH_ARM_GCC arm-none-eabi-gcc)
if(NOT ZH_ARM_GCC)
    message(FATAL_ERROR "missing: arm-none-eabi-gcc\nRun tools/zh setup, or install from Debian: "
                        "gcc-arm-none-eabi libnewlib-arm-none-eabi")
endif()
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
# Nothing links without a linker script, so CMake tries the compiler on an archive.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16")
set(CMAKE_EXECUTABLE_SUFFIX_C .elf)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
