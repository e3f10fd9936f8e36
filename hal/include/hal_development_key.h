/* The public development key: it lets the tools unlock an example port on a bench, and protects
 * nothing.
 *
 * A product builds with -DZH_RELEASE=ON and -DZH_ACCESS_KEY=<file>: sixteen bytes of its own,
 * different for each drive. Give `tools/zh run --key` the same file.
 */
#ifndef HAL_DEVELOPMENT_KEY_H
#define HAL_DEVELOPMENT_KEY_H

#ifdef ZH_RELEASE
#error "release build: everybody knows the development key; include hal_access_key.h instead"
#endif

/* "ZeroHertz develo" */
#define HAL_DEVELOPMENT_KEY                                                                        \
    {                                                                                              \
        0x5A, 0x65, 0x72, 0x6F, 0x48, 0x65, 0x72, 0x74, 0x7A, 0x20, 0x64, 0x65, 0x76, 0x65, 0x6C,  \
            0x6F                                                                                   \
    }

#endif
