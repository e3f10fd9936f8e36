# zh_image(<source>... [BOARD <name or file>]): the flash image of the port in the current folder, from
# its sources, the firmware, hal/cortex_m, the parameters of ZH_CONFIG and the memory map memory.ld beside
# them. BOARD, a file of host_sim/boards or of the port, goes instead of the configuration's board, ZH_BOARD instead of both. Makes
# firmware.elf with a checked CRC, firmware.bin, .hex and .map.
set(kind STRING)
if("${ZH_CONFIG}" MATCHES "/")
    set(kind FILEPATH)
endif()
set(ZH_CONFIG "recommended" CACHE ${kind} "Configuration in the image: one of host_sim/configs or a TOML file")

set(ZH_BOARD "" CACHE FILEPATH "Board file (TOML) instead of the port's or the configuration's")

include(ZhGainTable) # Python, ZH_MOTOR

# zh_find_port(<folder of hal/ or path>): sets ZH_PORT_FOLDER and ZH_PORT_NAME, or says what is wrong.
function(zh_find_port port)
    get_filename_component(folder "${port}" ABSOLUTE)
    get_filename_component(name "${folder}" NAME)
    set(template "${PROJECT_SOURCE_DIR}/hal/template")
    if(NOT IS_DIRECTORY "${folder}")
        message(FATAL_ERROR "ZH_PORT: no folder ${folder}; give a folder of hal/ or the path of a copy of ${template}")
    endif()
    foreach(file IN ITEMS CMakeLists.txt main.c memory.ld)
        if(NOT EXISTS "${folder}/${file}")
            message(FATAL_ERROR "ZH_PORT: no ${folder}/${file}; start from ${template}/${file}")
        endif()
    endforeach()
    cmake_path(IS_PREFIX PROJECT_SOURCE_DIR "${folder}" inside)
    if(NOT inside)
        # As if it lay in hal/: no path of this machine in the image.
        add_compile_options(-ffile-prefix-map=${folder}=hal/${name})
        add_link_options(-ffile-prefix-map=${folder}=hal/${name})
    endif()
    set(ZH_PORT_FOLDER "${folder}" PARENT_SCOPE)
    set(ZH_PORT_NAME "${name}" PARENT_SCOPE)
endfunction()

# image_params.h in the current folder of the build: ZH_CONFIG on a board, for ZH_MOTOR.
function(zh_image_parameters board)
    set(header "${CMAKE_CURRENT_BINARY_DIR}/image_params.h")
    set(options --config "${ZH_CONFIG}")
    if(board)
        list(APPEND options --board "${board}")
    endif()
    if(ZH_MOTOR)
        list(APPEND options --motor "${ZH_MOTOR}")
    endif()
    if(ZH_ESTIMATOR_PARAMS)
        list(APPEND options --estimator-params "${ZH_ESTIMATOR_PARAMS}")
    endif()
    if(TARGET zh_fieldbus)
        list(APPEND options --fieldbus)
    endif()
    add_custom_command(
        OUTPUT "${header}"
        COMMAND "${Python3_EXECUTABLE}" -S -B "${ZH_TOOLS_DIR}/generate_params.py" ${options}
                --out "${header}" --depfile "${header}.d"
        DEPENDS "${ZH_TOOLS_DIR}/generate_params.py"
        DEPFILE "${header}.d"
        WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}"
        COMMENT "Parameters of configuration ${ZH_CONFIG}"
        VERBATIM)
    add_custom_target(zh_image_parameters DEPENDS "${header}")
endfunction()

function(zh_image)
    cmake_parse_arguments(PARSE_ARGV 0 IMAGE "" "BOARD" "")
    if(ZH_BOARD)
        set(IMAGE_BOARD "${ZH_BOARD}")
    endif()
    zh_image_parameters("${IMAGE_BOARD}")
    add_executable(zh_image ${IMAGE_UNPARSED_ARGUMENTS} $<TARGET_OBJECTS:zh_hal_cortex_m>)
    set_target_properties(zh_image PROPERTIES OUTPUT_NAME firmware RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}")
    target_include_directories(zh_image PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}" "${PROJECT_BINARY_DIR}/generated")
    if(ZH_RELEASE)
        target_compile_definitions(zh_image PRIVATE ZH_RELEASE)
    endif()
    target_include_directories(zh_hal_cortex_m PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}" "${CMAKE_CURRENT_BINARY_DIR}"
                               "${PROJECT_BINARY_DIR}/generated")
    target_compile_definitions(
        zh_hal_cortex_m PRIVATE ZH_PORT="${ZH_PORT_NAME}" ZH_VERSION="${PROJECT_VERSION}")
    add_dependencies(zh_hal_cortex_m zh_image_parameters)
    if(TARGET zh_terminals)
        target_compile_definitions(zh_image PRIVATE ZH_TERMINALS)
        target_link_libraries(zh_image PRIVATE zh_terminals)
    endif()
    target_link_libraries(zh_image PRIVATE zh_hal_cortex_m zh_warnings)
    set(cortex_m "${PROJECT_SOURCE_DIR}/hal/cortex_m")
    set(script "${cortex_m}/sections.ld")
    set(fast "${cortex_m}/fast.ld")
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/fast.ld")
        set(fast "${CMAKE_CURRENT_SOURCE_DIR}/fast.ld")
        target_compile_definitions(zh_hal_cortex_m PRIVATE CM_FAST_CODE)
    endif()
    target_link_options(
        zh_image
        PRIVATE -nostartfiles -nostdlib
                -L${CMAKE_CURRENT_SOURCE_DIR} -L${cortex_m} -Tmemory.ld -T${script}
                LINKER:--gc-sections,--fatal-warnings,--no-warn-rwx-segments,--build-id=none
                LINKER:-Map=${PROJECT_BINARY_DIR}/firmware.map)
    target_link_libraries(zh_image PRIVATE gcc)
    set_target_properties(
        zh_image PROPERTIES LINK_DEPENDS "${script};${CMAKE_CURRENT_SOURCE_DIR}/memory.ld;${fast}")
    add_custom_command(
        TARGET zh_image POST_BUILD
        COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/tools/stamp_image.py"
                --objcopy "${CMAKE_OBJCOPY}" "$<TARGET_FILE:zh_image>"
        BYPRODUCTS "${PROJECT_BINARY_DIR}/firmware.bin" "${PROJECT_BINARY_DIR}/firmware.hex"
                   "${PROJECT_BINARY_DIR}/firmware.map"
        COMMENT "Writing the CRC of firmware.elf, firmware.bin and firmware.hex")
endfunction()

# zh_image_on_mps2(): the same objects, without the port's own, as a program of the emulated board
# (target zh_mps2, mps2/firmware.elf): `zh pil --board`. In the port's folder mps2/memory.ld gives memory to what its
# fast.ld places.
function(zh_image_on_mps2)
    set(port "${PROJECT_SOURCE_DIR}/hal/qemu_mps2")
    set(host "${PROJECT_SOURCE_DIR}/hal/host")
    set(cortex_m "${PROJECT_SOURCE_DIR}/hal/cortex_m")
    set(bus "")
    if(TARGET zh_fieldbus)
        set(bus ${port}/bus.c)
    endif()
    add_executable(
        zh_mps2 EXCLUDE_FROM_ALL
        ${port}/main.c ${bus} ${port}/host_link.c ${port}/inject.c ${port}/plant.c ${port}/semihosting.c ${host}/ram_flash.c
        $<TARGET_OBJECTS:zh_hal_cortex_m>)
    set_target_properties(
        zh_mps2 PROPERTIES OUTPUT_NAME firmware RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/mps2")
    target_compile_options(zh_mps2 PRIVATE -fno-tree-loop-distribute-patterns)
    target_include_directories(zh_mps2 PRIVATE "${port}" "${host}" "${PROJECT_BINARY_DIR}/generated")
    target_link_libraries(zh_mps2 PRIVATE zh_hal_cortex_m zh_warnings gcc)
    target_link_options(
        zh_mps2
        PRIVATE -nostartfiles -nostdlib
                -L${CMAKE_CURRENT_SOURCE_DIR}/mps2 -L${CMAKE_CURRENT_SOURCE_DIR} -L${cortex_m}
                -Tmemory.ld -T${cortex_m}/sections.ld
                LINKER:--gc-sections,--fatal-warnings,--no-warn-rwx-segments,--build-id=none)
    set_target_properties(
        zh_mps2 PROPERTIES LINK_DEPENDS
        "${cortex_m}/sections.ld;${CMAKE_CURRENT_SOURCE_DIR}/fast.ld;${CMAKE_CURRENT_SOURCE_DIR}/mps2/memory.ld")
    add_custom_command(
        TARGET zh_mps2 POST_BUILD
        COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/tools/stamp_image.py"
                --objcopy "${CMAKE_OBJCOPY}" "$<TARGET_FILE:zh_mps2>"
        COMMENT "Writing the CRC of mps2/firmware.elf")
endfunction()

# What the source is, for the image's header: looked up at every build, written when it changed.
add_custom_target(
    zh_git_version
    COMMAND "${CMAKE_COMMAND}" -DSOURCE=${PROJECT_SOURCE_DIR}
            -DHEADER=${PROJECT_BINARY_DIR}/generated/cm_version.h -P
            "${CMAKE_CURRENT_LIST_DIR}/ZhGitVersion.cmake"
    BYPRODUCTS "${PROJECT_BINARY_DIR}/generated/cm_version.h"
    COMMENT "git describe")
