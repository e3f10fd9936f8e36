// The edge between C++ and the C ABI: no exception crosses it, a text stays behind.
#ifndef ZH_C_BOUNDARY_HPP
#define ZH_C_BOUNDARY_HPP

#include <exception>
#include <new>
#include <string>
#include <string_view>

namespace zh {

// Of this thread.
inline std::string &last_error()
{
    static thread_local std::string text = "no error";
    return text;
}

// Keeps the text (cut when even that finds no memory), hands the status back.
inline int fail(int status, std::string_view text) noexcept
{
    try {
        last_error() = text;
    } catch (...) {
        last_error().clear();
    }
    return status;
}

// Runs the body; whatever it throws becomes `failed` and a text.
template <typename T, typename Body> T guarded(T failed, const Body &body) noexcept
{
    try {
        return body();
    } catch (const std::bad_alloc &) {
        fail(0, "out of memory");
    } catch (const std::exception &error) {
        fail(0, error.what());
    } catch (...) {
        fail(0, "unknown error");
    }
    return failed;
}

} // namespace zh

#endif
