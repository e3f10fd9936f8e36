# cmake -DSOURCE=<checkout> -DHEADER=<file> -P: writes ZH_GIT. No git, no checkout: "unknown".
cmake_minimum_required(VERSION 3.22)
find_package(Git QUIET)
set(git "unknown")
if(GIT_FOUND)
    execute_process(
        COMMAND "${GIT_EXECUTABLE}" -C "${SOURCE}" describe --always --dirty --abbrev=12 --tags
        OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
        RESULT_VARIABLE failed)
    if(NOT failed)
        string(SUBSTRING "${described}" 0 43 git)
    endif()
endif()
file(CONFIGURE OUTPUT "${HEADER}" CONTENT "#define ZH_GIT \"@git@\"\n" @ONLY)
