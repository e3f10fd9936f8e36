# ZH_PYTHON: the interpreter of the environment that tools/zh keeps, else the machine's own.
if(EXISTS "${PROJECT_SOURCE_DIR}/.venv/bin/python")
    set(ZH_PYTHON "${PROJECT_SOURCE_DIR}/.venv/bin/python")
else()
    find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter)
    set(ZH_PYTHON "${Python3_EXECUTABLE}")
endif()
