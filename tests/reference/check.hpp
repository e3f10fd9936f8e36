// A test program in one header: named cases, checks that count failures, an exit code.
#ifndef ZH_TEST_CHECK_HPP
#define ZH_TEST_CHECK_HPP

#include <cmath>
#include <cstdio>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

namespace check {

inline int failures = 0;

inline void that(bool holds, const char *text, const char *file, int line)
{
    if (!holds) {
        ++failures;
        std::printf("%s:%d: %s\n", file, line, text);
    }
}

// NaN on either side fails.
inline void near(double actual, double expected, double tolerance, const char *text,
                 const char *file, int line)
{
    if (!(std::abs(actual - expected) <= tolerance)) {
        ++failures;
        std::printf("%s:%d: %s = %.12g, expected %.12g within %.3g\n", file, line, text, actual,
                    expected, tolerance);
    }
}

using Case = std::pair<const char *, std::function<void()>>;

inline int run(std::initializer_list<Case> cases)
{
    for (const auto &[name, body] : cases) {
        const int before = failures;
        body();
        std::printf("%s %s\n", failures == before ? "ok  " : "FAIL", name);
    }
    return failures == 0 ? 0 : 1;
}

// The text of the exception of type E that `body` throws; empty when it throws none.
template <class E> std::string message_of(const std::function<void()> &body)
{
    try {
        body();
    } catch (const E &error) {
        return error.what();
    }
    return {};
}

} // namespace check

#define CHECK(condition) check::that((condition), #condition, __FILE__, __LINE__)
#define CHECK_NEAR(actual, expected, tolerance)                                                    \
    check::near((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)
#define CHECK_RELATIVE(actual, expected, share)                                                    \
    check::near((actual), (expected), (share)*std::abs(expected), #actual, __FILE__, __LINE__)

#endif
