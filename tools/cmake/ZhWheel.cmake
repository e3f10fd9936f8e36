# What goes into a wheel beside the Python modules, as zerohertz/packed (zerohertz/paths.py): the library, and
# the files that a run reads, in the folders of the checkout.
include(ZhEstimator)
set(packed zerohertz/packed)
install(TARGETS zerohertz_sil LIBRARY DESTINATION "${packed}/lib" COMPONENT wheel)
# Estimators alone, ours and the rivals; build.targets of tools/zerohertz/release/pyproject.toml names them too.
foreach(name IN ITEMS hasegawa ${ZH_RIVALS})
    install(TARGETS zh_estimator_${name} LIBRARY DESTINATION "${packed}/lib" COMPONENT wheel)
endforeach()
foreach(folder IN ITEMS
        gain_tables host_sim/boards host_sim/configs host_sim/rigs host_sim/scenarios firmware/parameters
        firmware/sequence firmware/terminals firmware/unit)
    install(DIRECTORY "${folder}/" DESTINATION "${packed}/${folder}" COMPONENT wheel
            FILES_MATCHING PATTERN "*.toml" PATTERN "l_gain.json" PATTERN "*.def")
endforeach()
# What `zh figures`, `zh report` and `zh golden` compare with.
install(FILES tools/docs/figures_paper.json tools/docs/figures_recommended.json tools/docs/atlas.png
        DESTINATION "${packed}/tools/docs" COMPONENT wheel)
install(FILES tests/sil/golden.json DESTINATION "${packed}/tests/sil" COMPONENT wheel)
# The page of `zh studio`, where `zh wheel` could build it.
install(DIRECTORY build/web/dist/ DESTINATION "${packed}/web" COMPONENT wheel OPTIONAL)
