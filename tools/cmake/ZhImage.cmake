# zh_image(<source>...): the flash image of the port in the current folder, from its sources, the
# firmware, hal/cortex_m, the configuration params_<ZH_CONFIG>.h and the memory map memory.ld beside
# them. Makes firmware.elf with a checked CRC, firmware.bin, .hex and .map.
set(ZH_CONFIG "recommended" CACHE STRING "Configuration in the image: hal/<port>/params_<it>.h")

find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter)

function(zh_image)
    set(params "params_${ZH_CONFIG}.h")
    if(NOT EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/${params}")
        message(FATAL_ERROR "ZH_CONFIG: no ${CMAKE_CURRENT_SOURCE_DIR}/${params}; make it with "
                            "tools/zh params --config ${ZH_CONFIG} --write ${CMAKE_CURRENT_SOURCE_DIR}/${params}")
    endif()
    add_executable(firmware ${ARGN} $<TARGET_OBJECTS:hal_cortex_m>)
    set_target_properties(firmware PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}")
    target_include_directories(firmware PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
    target_include_directories(hal_cortex_m PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}" "${PROJECT_BINARY_DIR}/generated")
    target_compile_definitions(
        hal_cortex_m PRIVATE ZH_PARAMS_HEADER="${params}" ZH_PORT="${ZH_PORT}" ZH_VERSION="${PROJECT_VERSION}")
    target_link_libraries(firmware PRIVATE hal_cortex_m zh_warnings)
    set(script "${PROJECT_SOURCE_DIR}/hal/cortex_m/sections.ld")
    target_link_options(
        firmware
        PRIVATE -nostartfiles -nostdlib
                -L${CMAKE_CURRENT_SOURCE_DIR} -Tmemory.ld -T${script}
                LINKER:--gc-sections,--fatal-warnings,--no-warn-rwx-segments,--build-id=none
                LINKER:-Map=${PROJECT_BINARY_DIR}/firmware.map)
    target_link_libraries(firmware PRIVATE gcc)
    set_target_properties(
        firmware PROPERTIES LINK_DEPENDS "${script};${CMAKE_CURRENT_SOURCE_DIR}/memory.ld")
    add_custom_command(
        TARGET firmware POST_BUILD
        COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/tools/stamp_image.py"
                --objcopy "${CMAKE_OBJCOPY}" "$<TARGET_FILE:firmware>"
        BYPRODUCTS "${PROJECT_BINARY_DIR}/firmware.bin" "${PROJECT_BINARY_DIR}/firmware.hex"
                   "${PROJECT_BINARY_DIR}/firmware.map"
        COMMENT "Writing the CRC of firmware.elf, firmware.bin and firmware.hex")
endfunction()

# What the source is, for the image's header: looked up at every build, written when it changed.
add_custom_target(
    zh_git_version
    COMMAND "${CMAKE_COMMAND}" -DSOURCE=${PROJECT_SOURCE_DIR}
            -DHEADER=${PROJECT_BINARY_DIR}/generated/cm_version.h -P
            "${CMAKE_CURRENT_LIST_DIR}/ZhGitVersion.cmake"
    BYPRODUCTS "${PROJECT_BINARY_DIR}/generated/cm_version.h"
    COMMENT "git describe")
