# zh_add_estimator(<variable> <estimator> [EXCLUDE_FROM_ALL]): a folder of firmware/law/estimator by its name,
# or a path to one elsewhere, becomes the target zh_law_estimator_<folder's name>; the variable gets that name.
set(ZH_ESTIMATOR_CONTRACT "${PROJECT_SOURCE_DIR}/firmware/law/estimator")

# Published estimators that ours is compared with (`zh arena`). In no image and in no default build; their
# unit tests are in tests/estimator.
set(ZH_RIVALS
    hinkkanen_full_order
    hybrid_crossover
    schauder_mras
    compensated_voltage_model
    reduced_order
    ekf
)

function(zh_add_estimator variable estimator)
    get_filename_component(folder "${estimator}" ABSOLUTE BASE_DIR "${ZH_ESTIMATOR_CONTRACT}")
    get_filename_component(name "${folder}" NAME)
    foreach(file IN ITEMS CMakeLists.txt estimator_types.h estimator_signals.def)
        if(NOT EXISTS "${folder}/${file}")
            message(FATAL_ERROR "ZH_ESTIMATOR: no ${folder}/${file}; a folder has what "
                                "${ZH_ESTIMATOR_CONTRACT}/estimator.h asks for")
        endif()
    endforeach()
    set(target zh_law_estimator_${name})
    if(NOT TARGET ${target})
        add_subdirectory("${folder}" "${PROJECT_BINARY_DIR}/firmware/law/estimator/${name}" ${ARGN})
        if(NOT TARGET ${target})
            message(FATAL_ERROR "ZH_ESTIMATOR: ${folder}/CMakeLists.txt makes no law_estimator_${name}; write "
                                "zh_firmware(law_estimator_${name} SOURCES ... USES law_base parameters)")
        endif()
        target_include_directories(${target} PUBLIC "${ZH_ESTIMATOR_CONTRACT}")
    endif()
    set(${variable} ${name} PARENT_SCOPE)
endfunction()
