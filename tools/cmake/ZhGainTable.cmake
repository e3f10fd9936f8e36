# zh_gain_table(<target> <folder>): l_gain.c of a motor folder (motor.toml, l_gain.json) becomes a
# source of the target, which is of the current folder; users include "<motor>/l_gain.h".
set(ZH_MOTOR "" CACHE PATH
    "Motor folder (motor.toml, l_gain.json), anywhere: its table joins those of gain_tables, or takes the \
place of the one of its name; a flash image is built for this motor instead of its configuration's")
set(ZH_TOOLS_DIR "${CMAKE_CURRENT_LIST_DIR}/..")

function(zh_gain_table target folder)
    get_filename_component(folder "${folder}" ABSOLUTE)
    get_filename_component(motor "${folder}" NAME)
    foreach(file IN ITEMS motor.toml l_gain.json)
        if(NOT EXISTS "${folder}/${file}")
            message(FATAL_ERROR "missing: ${folder}/${file}; a motor folder has motor.toml, written by hand as "
                                "gain_tables/README.md says, and l_gain.json of tools/zh design ${folder}")
        endif()
    endforeach()
    set(out "${CMAKE_CURRENT_BINARY_DIR}/${motor}")
    set(script "${ZH_TOOLS_DIR}/generate_gain_table.py")
    add_custom_command(
        OUTPUT "${out}/l_gain.c" "${out}/l_gain.h"
        COMMAND "${Python3_EXECUTABLE}" -S -B "${script}" "${folder}" --out "${out}" --depfile "${out}/l_gain.d"
        DEPENDS "${folder}/motor.toml" "${folder}/l_gain.json" "${script}"
        DEPFILE "${out}/l_gain.d"
        COMMENT "Gain table of ${motor}"
        VERBATIM)
    target_sources(${target} PRIVATE "${out}/l_gain.c" "${out}/l_gain.h")
endfunction()
