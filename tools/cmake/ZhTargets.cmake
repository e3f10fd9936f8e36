# Usage requirements shared by all targets: link them, PRIVATE unless said otherwise.
#
#   zh_float_exact    the floating-point contract: same bits with every compiler and level
#   zh_warnings       the warning set of the firmware (CONVENTIONS 12), as errors
#   zh_warnings_test  the same for unit tests, which compare against double precision

add_library(zh_float_exact INTERFACE)
# no errno: sqrtf becomes the one instruction it is; the value stays the same.
target_compile_options(zh_float_exact INTERFACE -ffp-contract=off -fno-fast-math -fno-math-errno)
# gcc 12 with FMA instructions contracts where it packs an add beside a subtract (vfmaddsub), even
# with -ffp-contract=off: seen in the observer's complex product. Without superword packing it cannot.
target_compile_options(
    zh_float_exact INTERFACE $<$<C_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)

set(ZH_WARNINGS_COMMON -Wall -Wextra -Wpedantic -Wshadow -Wundef -Wcast-align -Wvla)
if(ZH_WERROR)
    list(APPEND ZH_WARNINGS_COMMON -Werror)
endif()
set(ZH_WARNINGS_VALUES -Wconversion -Wsign-conversion -Wdouble-promotion -Wfloat-equal -Wswitch-enum)
set(ZH_WARNINGS_C -Wstrict-prototypes -Wmissing-prototypes)
set(ZH_WARNINGS_CXX -Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast)

add_library(zh_warnings INTERFACE)
target_compile_options(
    zh_warnings
    INTERFACE
        ${ZH_WARNINGS_COMMON}
        $<$<COMPILE_LANGUAGE:C>:${ZH_WARNINGS_VALUES};${ZH_WARNINGS_C}>
        # Double is the working type of the plant, so promotion to it is no accident there.
        $<$<COMPILE_LANGUAGE:CXX>:-Wconversion;-Wsign-conversion;-Wswitch-enum;${ZH_WARNINGS_CXX}>
        $<$<COMPILE_LANG_AND_ID:C,Clang>:-Wreserved-identifier>
        $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wreserved-identifier>)

add_library(zh_warnings_test INTERFACE)
target_compile_options(
    zh_warnings_test
    INTERFACE ${ZH_WARNINGS_COMMON} $<$<COMPILE_LANGUAGE:C>:${ZH_WARNINGS_C}>
              $<$<COMPILE_LANGUAGE:CXX>:${ZH_WARNINGS_CXX}>)
