// What the C++ library of clang 14 (Debian's emscripten) lacks of C++20, as far as host_sim uses
// it: numbers in text, and bit_cast. Included before every file of the preset `wasm`.
#ifndef ZH_LIBCXX_OF_CLANG_14_HPP
#define ZH_LIBCXX_OF_CLANG_14_HPP

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 15000

namespace std {

template <typename To, typename From> constexpr To bit_cast(const From &from) noexcept
{
    return __builtin_bit_cast(To, from);
}

// As the standard's: no leading blank, no plus, no hexadecimal. The C library rounds correctly.
inline from_chars_result from_chars(const char *first, const char *last, double &value)
{
    const std::string text(first, last);
    const std::size_t signs = text.compare(0, 1, "-") == 0 ? 1U : 0U;
    const bool digit = text.find_first_of("0123456789.", signs) == signs;
    const bool hexadecimal = text.find_first_of("xX") == signs + 1;
    if (!digit || hexadecimal) {
        return {first, errc::invalid_argument};
    }
    char *end = nullptr;
    value = strtod(text.c_str(), &end);
    return end == text.c_str() ? from_chars_result{first, errc::invalid_argument}
                               : from_chars_result{first + (end - text.c_str()), errc{}};
}

// The shortest text that reads back as the same number.
template <typename Number>
to_chars_result shortest_chars(char *first, char *last, Number value, int most_digits)
{
    char text[40];
    int length = 0;
    for (int digits = 1; digits <= most_digits; ++digits) {
        length = snprintf(text, sizeof text, "%.*g", digits, static_cast<double>(value));
        if (!(static_cast<Number>(strtod(text, nullptr)) < value) &&
            !(static_cast<Number>(strtod(text, nullptr)) > value)) {
            break;
        }
    }
    if (length > last - first) {
        return {last, errc::value_too_large};
    }
    memcpy(first, text, static_cast<std::size_t>(length));
    return {first + length, errc{}};
}

inline to_chars_result to_chars(char *first, char *last, double value)
{
    return shortest_chars(first, last, value, 17);
}

inline to_chars_result to_chars(char *first, char *last, float value)
{
    return shortest_chars(first, last, value, 9);
}

} // namespace std

#endif
#endif
