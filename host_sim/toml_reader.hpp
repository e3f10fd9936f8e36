// One checked reader for every TOML file of the simulation.
//
// A document is the flat list of its values under dotted keys, each with the line it stands on, so
// that an override ("motor.Rs_ohm=1.1") replaces one entry without touching the file again. A
// reader hands values out with their range checked and, at the end, refuses keys nobody asked for.
// Every complaint reads "file:line: key: problem; remedy".
#ifndef ZH_TOML_READER_HPP
#define ZH_TOML_READER_HPP

#include <array>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "profile.hpp"

namespace zh {

struct ConfigError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// What a value may be; anything else (dates, mixed arrays) is kept as its name for the message.
struct UnsupportedValue {
    std::string what;
};
using NumberList = std::vector<double>;
using TomlValue = std::variant<bool, double, std::string, NumberList, std::vector<ProfilePoint>,
                               UnsupportedValue>;

class TomlDocument {
public:
    static TomlDocument from_file(const std::string &path);
    static TomlDocument from_text(std::string_view text, const std::string &name);

    // "section.key=value" with a TOML value; a bare word is text; "section.list.1=5" sets the
    // second element of a list. Refuses what cannot be parsed; an unknown key is refused by the
    // reader.
    void set(std::string_view assignment);

    const std::string &name() const
    {
        return name_;
    }

private:
    friend class TomlReader;
    static constexpr int from_override = -1;
    struct Entry {
        std::string key;
        TomlValue value;
        int line;
    };

    std::string location(int line) const;
    const Entry *find(std::string_view key) const;
    void put(std::string key, TomlValue value, int line);
    void sort();

    std::string name_;
    std::vector<Entry> entries_; // sorted by key
    std::vector<std::pair<std::string, int>> sections_;
};

// Accepted interval; the default takes every finite number.
struct Range {
    double lowest = -std::numeric_limits<double>::max();
    double highest = std::numeric_limits<double>::max();
    bool lowest_excluded = false;
};
constexpr Range positive(double highest)
{
    return {0.0, highest, true};
}
constexpr Range not_negative(double highest)
{
    return {0.0, highest, false};
}
constexpr Range within(double lowest, double highest)
{
    return {lowest, highest, false};
}

class TomlReader {
public:
    explicit TomlReader(const TomlDocument &document);

    bool has(std::string_view key) const;
    double number(std::string_view key, Range range);
    double number_or(std::string_view key, double fallback, Range range);
    int integer(std::string_view key, int lowest, int highest);
    int integer_or(std::string_view key, int fallback, int lowest, int highest);
    std::string text(std::string_view key);
    std::string text_or(std::string_view key, std::string_view fallback);
    // One of the words; returns its index.
    std::size_t choice(std::string_view key, std::initializer_list<std::string_view> words);
    template <std::size_t N>
    std::array<double, N> numbers_or(std::string_view key, const std::array<double, N> &fallback,
                                     Range range)
    {
        std::array<double, N> values = fallback;
        if (has(key)) {
            fill(key, values, range);
        }
        return values;
    }
    Profile profile(std::string_view key, Range range);
    Profile profile_or(std::string_view key, double fallback, Range range);
    // All "section.name = value" of a section as text, for parameters that somebody else checks.
    std::vector<std::pair<std::string, std::string>> pass_through(std::string_view section);

    // Refuses the document: the value at `key` is there but senseless.
    [[noreturn]] void reject(std::string_view key, const std::string &problem,
                             const std::string &remedy) const;
    // To be called last: a key that nobody read is a mistake.
    void finish() const;

private:
    const TomlDocument::Entry &take(std::string_view key);
    double checked(std::string_view key, double value, Range range) const;
    void fill(std::string_view key, std::span<double> values, Range range);
    [[noreturn]] void reject_type(std::string_view key, const TomlValue &value,
                                  const std::string &expected) const;

    const TomlDocument &document_;
    std::vector<char> taken_;
    mutable std::vector<std::string_view> known_;
};

} // namespace zh

#endif
