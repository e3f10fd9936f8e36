# ZH_PYTHON: the interpreter of the environment that tools/zh keeps, else the machine's own.
if(EXISTS "${PROJECT_SOURCE_DIR}/.venv/bin/python")
    set(ZH_PYTHON "${PROJECT_SOURCE_DIR}/.venv/bin/python")
else()
    set(ZH_PYTHON "${Python3_EXECUTABLE}")
endif()
