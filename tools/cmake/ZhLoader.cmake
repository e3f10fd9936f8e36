# zh_loader(BOARD <name> [SOURCES <file>...] [DEFINITIONS <definition>...]): for a port with a folder boot/
#   target zh_boot   the boot loader, loader/loader.elf and .bin, from boot/boot_port.c and the sources;
#                    there when Monocypher is (tools/fetch_monocypher.sh puts it into .cache/monocypher)
#   target zh_above  the application above the loader, above/firmware.elf and .bin: the objects of the
#                    image, its main.c with ZH_ABOVE, linked with boot/memory.ld; above/board.txt holds the name for its header,
#                    and `release` below it for a release
# Neither is built unless asked for, and neither changes the image.
set(ZH_MONOCYPHER "${PROJECT_SOURCE_DIR}/.cache/monocypher" CACHE PATH "Folder with monocypher.c and monocypher.h")
set(ZH_UPDATE_KEY "" CACHE FILEPATH
    "File with the public key of updates, 64 hexadecimal digits; empty: the development key")
# EdDSA's public key of the seed "ZeroHertz development update key": everybody can sign for it.
set(ZH_DEVELOPMENT_UPDATE_KEY fdc94dcfc97c70ec27da08712057cf43abb304f707b368a877ef5026a53cb490)

# boot_key.h in the folder `generated` of the build.
function(zh_update_key board)
    set(advice "give -DZH_UPDATE_KEY=<file of 64 hexadecimal digits>; tools/zh update --make-key makes one")
    set(digits ${ZH_DEVELOPMENT_UPDATE_KEY})
    if(ZH_UPDATE_KEY)
        if(NOT EXISTS "${ZH_UPDATE_KEY}")
            message(FATAL_ERROR "ZH_UPDATE_KEY: no file ${ZH_UPDATE_KEY}; ${advice}")
        endif()
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${ZH_UPDATE_KEY}")
        file(READ "${ZH_UPDATE_KEY}" digits)
        string(STRIP "${digits}" digits)
        string(TOLOWER "${digits}" digits)
        string(LENGTH "${digits}" length)
        if(NOT length EQUAL 64 OR NOT digits MATCHES "^[0-9a-f]+$")
            message(FATAL_ERROR "ZH_UPDATE_KEY: ${ZH_UPDATE_KEY} holds no public key; ${advice}")
        endif()
    endif()
    set(refused "")
    if(digits STREQUAL ZH_DEVELOPMENT_UPDATE_KEY)
        # A release has no loader unless it has a key: the image alone may still be built.
        set(refused "#ifdef ZH_RELEASE\n#error \"release build: everybody has the development key; ${advice}\"\n#endif\n")
    endif()
    string(REGEX REPLACE "(..)" "0x\\1, " bytes "${digits}")
    string(HEX "${board}" name)
    string(APPEND name "00000000000000000000000000000000")
    string(SUBSTRING "${name}" 0 32 name)
    string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u, " words "${name}")
    set(text "/* Made by tools/cmake/ZhLoader.cmake. */\n${refused}#define BOOT_PUBLIC_KEY {${bytes}}\n")
    string(APPEND text "#define BOOT_BOARD {${words}}\n")
    file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/boot_key.h" CONTENT "${text}" @ONLY)
endfunction()

function(zh_loader)
    cmake_parse_arguments(PARSE_ARGV 0 BOOT "" "BOARD" "SOURCES;DEFINITIONS")
    zh_application_above("${BOOT_BOARD}")
    if(NOT EXISTS "${ZH_MONOCYPHER}/monocypher.c")
        return()
    endif()
    zh_update_key("${BOOT_BOARD}")
    set(boot "${PROJECT_SOURCE_DIR}/hal/boot")
    set(cortex_m "${PROJECT_SOURCE_DIR}/hal/cortex_m")
    set(host "${PROJECT_SOURCE_DIR}/firmware/host")
    # Libraries of their own: Monocypher's sources are not ours, and neither are their warnings.
    add_library(zh_monocypher OBJECT EXCLUDE_FROM_ALL "${ZH_MONOCYPHER}/monocypher.c")
    target_compile_definitions(zh_monocypher PRIVATE BLAKE2_NO_UNROLLING) # an eighth of the flash
    target_compile_options(zh_monocypher PRIVATE -Os -fno-inline-small-functions -ffunction-sections -fdata-sections)
    add_library(zh_boot_memory OBJECT EXCLUDE_FROM_ALL ${cortex_m}/cm_memory.c)
    target_compile_options(zh_boot_memory PRIVATE -Os -fno-lto -fno-builtin -fno-tree-loop-distribute-patterns)
    add_executable(
        zh_boot EXCLUDE_FROM_ALL
        ${boot}/boot_flash.c ${boot}/boot_image.c ${boot}/boot_journal.c ${boot}/boot_link.c ${boot}/boot_main.c
        ${boot}/boot_reset.c ${boot}/boot_start.c ${host}/command.c ${host}/crc32c.c boot/boot_port.c
        ${BOOT_SOURCES} $<TARGET_OBJECTS:zh_monocypher>
        $<TARGET_OBJECTS:zh_boot_memory>)
    set_target_properties(
        zh_boot PROPERTIES OUTPUT_NAME loader RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/loader"
                           LINK_DEPENDS "${boot}/boot.ld;${CMAKE_CURRENT_SOURCE_DIR}/boot/loader.ld")
    target_compile_options(zh_boot PRIVATE -Os -fno-inline-small-functions -ffunction-sections -fno-tree-loop-distribute-patterns)
    target_compile_definitions(zh_boot PRIVATE ${BOOT_DEFINITIONS} $<$<BOOL:${ZH_RELEASE}>:ZH_RELEASE>)
    target_include_directories(
        zh_boot PRIVATE "${boot}" "${cortex_m}" "${CMAKE_CURRENT_SOURCE_DIR}" "${PROJECT_BINARY_DIR}/generated")
    target_include_directories(zh_boot SYSTEM PRIVATE "${ZH_MONOCYPHER}")
    target_link_libraries(zh_boot PRIVATE zh_law_base zh_hal_interface zh_warnings gcc)
    target_include_directories(zh_boot PRIVATE "${host}")
    target_link_options(
        zh_boot PRIVATE -nostartfiles -nostdlib -L${CMAKE_CURRENT_SOURCE_DIR}/boot -Tloader.ld -T${boot}/boot.ld
                        LINKER:--gc-sections,--fatal-warnings,--no-warn-rwx-segments,--build-id=none)
    add_custom_command(
        TARGET zh_boot POST_BUILD
        COMMAND "${CMAKE_OBJCOPY}" -O binary "$<TARGET_FILE:zh_boot>" "${PROJECT_BINARY_DIR}/loader/loader.bin"
        VERBATIM)
endfunction()

function(zh_application_above board)
    get_target_property(sources zh_image SOURCES)
    get_target_property(includes zh_image INCLUDE_DIRECTORIES)
    get_target_property(definitions zh_image COMPILE_DEFINITIONS)
    set(cortex_m "${PROJECT_SOURCE_DIR}/hal/cortex_m")
    add_executable(zh_above EXCLUDE_FROM_ALL ${sources})
    set(folder "${PROJECT_BINARY_DIR}/above")
    set_target_properties(
        zh_above PROPERTIES OUTPUT_NAME firmware RUNTIME_OUTPUT_DIRECTORY "${folder}" LINK_DEPENDS
        "${cortex_m}/sections.ld;${CMAKE_CURRENT_SOURCE_DIR}/boot/memory.ld")
    target_include_directories(zh_above PRIVATE ${includes})
    target_compile_definitions(zh_above PRIVATE ZH_ABOVE)
    if(definitions)
        target_compile_definitions(zh_above PRIVATE ${definitions})
    endif()
    target_link_libraries(zh_above PRIVATE zh_hal_cortex_m zh_warnings gcc)
    target_link_options(
        zh_above
        PRIVATE -nostartfiles -nostdlib
                -L${CMAKE_CURRENT_SOURCE_DIR}/boot -L${CMAKE_CURRENT_SOURCE_DIR} -L${cortex_m}
                -Tmemory.ld -T${cortex_m}/sections.ld
                LINKER:--gc-sections,--fatal-warnings,--no-warn-rwx-segments,--build-id=none)
    set(kind "$<$<BOOL:${ZH_RELEASE}>:release\n>")
    file(GENERATE OUTPUT "${folder}/board.txt" CONTENT "${board}\n${kind}")
    add_custom_command(
        TARGET zh_above POST_BUILD
        COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/tools/stamp_image.py"
                --objcopy "${CMAKE_OBJCOPY}" "$<TARGET_FILE:zh_above>"
        COMMENT "Writing the CRC of above/firmware.elf")
endfunction()
