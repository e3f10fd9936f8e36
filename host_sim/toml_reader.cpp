#include "toml_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

namespace {
// The parser asserts things that garbage can break (and assumes them under NDEBUG): here they
// throw.
[[noreturn]] void parser_gave_up()
{
    throw zh::ConfigError("the text confuses the TOML parser");
}
} // namespace

#undef NDEBUG
#define TOML_HEADER_ONLY  1
#define TOML_ASSERT(expr) ((expr) ? static_cast<void>(0) : parser_gave_up())
#include <toml++/toml.h>

namespace zh {
namespace {

std::string number_text(double value)
{
    std::array<char, 32> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return {buffer.data(), end.ptr};
}

std::optional<double> number_of(const toml::node &node)
{
    if (const auto *integer = node.as_integer()) {
        return static_cast<double>(integer->get());
    }
    if (const auto *floating = node.as_floating_point()) {
        return floating->get();
    }
    return std::nullopt;
}

// [1, 2, 3] or [[t, v], ...]; anything else is unsupported.
TomlValue value_of_array(const toml::array &array)
{
    NumberList numbers;
    std::vector<ProfilePoint> points;
    for (const toml::node &item : array) {
        if (const auto number = number_of(item)) {
            numbers.push_back(*number);
            continue;
        }
        const auto *pair = item.as_array();
        if (pair == nullptr || pair->size() != 2) {
            return UnsupportedValue{"a list of something else than numbers or [time, value]"};
        }
        const auto t = number_of((*pair)[0]);
        const auto v = number_of((*pair)[1]);
        if (!t || !v) {
            return UnsupportedValue{"a list of something else than numbers or [time, value]"};
        }
        points.push_back({*t, *v});
    }
    if (!numbers.empty() && !points.empty()) {
        return UnsupportedValue{"a list that mixes numbers and [time, value]"};
    }
    if (!points.empty()) {
        return points;
    }
    return numbers;
}

TomlValue value_of(const toml::node &node)
{
    if (const auto number = number_of(node)) {
        return *number;
    }
    if (const auto *boolean = node.as_boolean()) {
        return boolean->get();
    }
    if (const auto *string = node.as_string()) {
        return string->get();
    }
    if (const auto *array = node.as_array()) {
        return value_of_array(*array);
    }
    return UnsupportedValue{"a date or time"};
}

int line_of(const toml::node &node)
{
    return static_cast<int>(node.source().begin.line);
}

std::string kind_of(const TomlValue &value)
{
    struct Name {
        std::string operator()(bool) const
        {
            return "a truth value";
        }
        std::string operator()(double) const
        {
            return "a number";
        }
        std::string operator()(const std::string &) const
        {
            return "text";
        }
        std::string operator()(const NumberList &list) const
        {
            return "a list of " + std::to_string(list.size()) + " numbers";
        }
        std::string operator()(const std::vector<ProfilePoint> &) const
        {
            return "a list of [time, value]";
        }
        std::string operator()(const UnsupportedValue &value) const
        {
            return value.what;
        }
    };
    return std::visit(Name{}, value);
}

std::string interval_text(const Range &range)
{
    if (range.highest >= std::numeric_limits<double>::max()) {
        return "any finite number";
    }
    return (range.lowest_excluded ? "more than " : "at least ") + number_text(range.lowest) +
           " and at most " + number_text(range.highest);
}

std::string_view section_of(std::string_view key)
{
    const std::size_t dot = key.rfind('.');
    return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

std::string_view trimmed(std::string_view text)
{
    constexpr std::string_view blanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) {
        return {};
    }
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

// Text without quotes.
bool is_bare_word(std::string_view text)
{
    const bool letters = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    });
    return letters && text != "true" && text != "false";
}

// The value of an override: the common case, a plain number, without the TOML parser.
TomlValue parse_value(std::string_view text, std::string_view assignment)
{
    double number = 0.0;
    const char *end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, number);
    if (parsed.ec == std::errc{} && parsed.ptr == end) {
        return number;
    }
    if (is_bare_word(text)) {
        return std::string(text);
    }
    try {
        const toml::table table = toml::parse("v = " + std::string(text));
        if (table.size() == 1 && table.get("v") != nullptr && !table.get("v")->is_table()) {
            return value_of(*table.get("v"));
        }
    } catch (const toml::parse_error &) {
        // Falls through to the one message for everything that is not a value.
    } catch (const ConfigError &) {
        // Likewise.
    }
    throw ConfigError("override: '" + std::string(assignment) +
                      "': the value is not TOML; write key=number, key=[..] or key=\"text\"");
}

} // namespace

TomlDocument TomlDocument::from_file(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw ConfigError(path + ": cannot be read; check the path and the permissions");
    }
    std::ostringstream text;
    if (!(text << file.rdbuf())) {
        throw ConfigError(path + ": is empty or not a file; give a TOML file");
    }
    return from_text(text.str(), path);
}

TomlDocument TomlDocument::from_text(std::string_view text, const std::string &name)
{
    TomlDocument document;
    document.name_ = name;
    const auto flatten = [&document](const auto &self, const toml::table &table,
                                     const std::string &prefix) -> void {
        for (const auto &[name_in_table, node] : table) {
            std::string key = prefix + std::string(name_in_table.str());
            if (const auto *inner = node.as_table()) {
                document.sections_.emplace_back(key, line_of(node));
                self(self, *inner, key + ".");
            } else {
                document.entries_.push_back({std::move(key), value_of(node), line_of(node)});
            }
        }
    };
    try {
        const toml::table table = toml::parse(text, name);
        flatten(flatten, table, "");
    } catch (const toml::parse_error &error) {
        throw ConfigError(name + ":" + std::to_string(error.source().begin.line) +
                          ": not valid TOML: " + std::string(error.description()) +
                          "; correct the line");
    } catch (const ConfigError &error) {
        throw ConfigError(name + ": not valid TOML: " + error.what() + "; rewrite the file");
    }
    document.sort();
    return document;
}

void TomlDocument::sort()
{
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry &a, const Entry &b) { return a.key < b.key; });
}

std::string TomlDocument::location(int line) const
{
    if (line == from_override) {
        return "override of " + name_;
    }
    return line > 0 ? name_ + ":" + std::to_string(line) : name_;
}

const TomlDocument::Entry *TomlDocument::find(std::string_view key) const
{
    const auto at =
        std::lower_bound(entries_.begin(), entries_.end(), key,
                         [](const Entry &entry, std::string_view k) { return entry.key < k; });
    return at != entries_.end() && at->key == key ? &*at : nullptr;
}

void TomlDocument::put(std::string key, TomlValue value, int line)
{
    const auto at =
        std::lower_bound(entries_.begin(), entries_.end(), key,
                         [](const Entry &entry, const std::string &k) { return entry.key < k; });
    if (at != entries_.end() && at->key == key) {
        at->value = std::move(value);
        at->line = line;
    } else {
        entries_.insert(at, {std::move(key), std::move(value), line});
    }
}

void TomlDocument::set(std::string_view assignment)
{
    const std::size_t equals = assignment.find('=');
    const std::string_view key = trimmed(assignment.substr(0, equals));
    if (equals == std::string_view::npos || key.empty()) {
        throw ConfigError("override: '" + std::string(assignment) +
                          "': no key=value; write for example motor.Rs_ohm=1.1");
    }
    TomlValue value = parse_value(trimmed(assignment.substr(equals + 1)), assignment);

    // "list.1": one element of a list that is there.
    const std::string_view list_key = section_of(key);
    const std::string_view last = key.substr(std::min(key.size(), list_key.size() + 1));
    std::size_t index = 0;
    const auto parsed = std::from_chars(last.data(), last.data() + last.size(), index);
    if (!list_key.empty() && parsed.ec == std::errc{} && parsed.ptr == last.data() + last.size()) {
        const Entry *entry = find(list_key);
        const auto *list = entry != nullptr ? std::get_if<NumberList>(&entry->value) : nullptr;
        const auto *number = std::get_if<double>(&value);
        if (list == nullptr || number == nullptr || index >= list->size()) {
            throw ConfigError("override: '" + std::string(assignment) +
                              "': no such list element; the key before the index must be a list "
                              "in the file, indices start at 0");
        }
        NumberList changed = *list;
        changed[index] = *number;
        put(std::string(list_key), std::move(changed), from_override);
        return;
    }
    put(std::string(key), std::move(value), from_override);
}

TomlReader::TomlReader(const TomlDocument &document)
    : document_(document), taken_(document.entries_.size(), 0)
{
}

bool TomlReader::has(std::string_view key) const
{
    known_.push_back(key);
    return document_.find(key) != nullptr;
}

const TomlDocument::Entry &TomlReader::take(std::string_view key)
{
    known_.push_back(key);
    const TomlDocument::Entry *entry = document_.find(key);
    if (entry == nullptr) {
        int line = 0;
        for (const auto &[section, section_line] : document_.sections_) {
            if (section == section_of(key)) {
                line = section_line;
            }
        }
        throw ConfigError(document_.location(line) + ": " + std::string(key) +
                          ": missing; add it to section [" + std::string(section_of(key)) + "]");
    }
    taken_[static_cast<std::size_t>(entry - document_.entries_.data())] = 1;
    return *entry;
}

void TomlReader::reject(std::string_view key, const std::string &problem,
                        const std::string &remedy) const
{
    const TomlDocument::Entry *entry = document_.find(key);
    throw ConfigError(document_.location(entry != nullptr ? entry->line : 0) + ": " +
                      std::string(key) + ": " + problem + "; " + remedy);
}

void TomlReader::reject_type(std::string_view key, const TomlValue &value,
                             const std::string &expected) const
{
    reject(key, "is " + kind_of(value), "give " + expected);
}

double TomlReader::checked(std::string_view key, double value, Range range) const
{
    if (!std::isfinite(value)) {
        reject(key, "is not a finite number", "give " + interval_text(range));
    }
    const bool too_low = range.lowest_excluded ? value <= range.lowest : value < range.lowest;
    if (too_low || value > range.highest) {
        reject(key, number_text(value) + " is out of range", "give " + interval_text(range));
    }
    return value;
}

double TomlReader::number(std::string_view key, Range range)
{
    const TomlDocument::Entry &entry = take(key);
    const auto *value = std::get_if<double>(&entry.value);
    if (value == nullptr) {
        reject_type(key, entry.value, "a number, " + interval_text(range));
    }
    return checked(key, *value, range);
}

double TomlReader::number_or(std::string_view key, double fallback, Range range)
{
    return has(key) ? number(key, range) : fallback;
}

int TomlReader::integer(std::string_view key, int lowest, int highest)
{
    const double value = number(key, within(lowest, highest));
    const int whole = static_cast<int>(value);
    if (std::abs(value - whole) > 0.0) {
        reject(key, number_text(value) + " is not a whole number", "give a whole number");
    }
    return whole;
}

int TomlReader::integer_or(std::string_view key, int fallback, int lowest, int highest)
{
    return has(key) ? integer(key, lowest, highest) : fallback;
}

std::string TomlReader::text(std::string_view key)
{
    const TomlDocument::Entry &entry = take(key);
    const auto *value = std::get_if<std::string>(&entry.value);
    if (value == nullptr) {
        reject_type(key, entry.value, "text in quotes");
    }
    return *value;
}

std::string TomlReader::text_or(std::string_view key, std::string_view fallback)
{
    return has(key) ? text(key) : std::string(fallback);
}

std::size_t TomlReader::choice(std::string_view key, std::initializer_list<std::string_view> words)
{
    const std::string value = text(key);
    const auto *at = std::find(words.begin(), words.end(), value);
    if (at == words.end()) {
        std::string list;
        for (const std::string_view word : words) {
            list += (list.empty() ? "\"" : ", \"") + std::string(word) + "\"";
        }
        reject(key, "\"" + value + "\" is unknown", "give one of " + list);
    }
    return static_cast<std::size_t>(std::distance(words.begin(), at));
}

void TomlReader::fill(std::string_view key, std::span<double> values, Range range)
{
    const TomlDocument::Entry &entry = take(key);
    const auto *list = std::get_if<NumberList>(&entry.value);
    if (list == nullptr || list->size() != values.size()) {
        reject_type(key, entry.value, "a list of " + std::to_string(values.size()) + " numbers");
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = checked(key, (*list)[i], range);
    }
}

Profile TomlReader::profile(std::string_view key, Range range)
{
    const TomlDocument::Entry &entry = take(key);
    const auto *points = std::get_if<std::vector<ProfilePoint>>(&entry.value);
    if (points == nullptr) {
        reject_type(key, entry.value, "a list of [time, value], for example [[0, 0], [1, 300]]");
    }
    double last_s = 0.0;
    for (const ProfilePoint &point : *points) {
        if (!std::isfinite(point.t_s) || point.t_s < last_s) {
            reject(key, "time " + number_text(point.t_s) + " is negative or goes back",
                   "give times in ascending order from 0");
        }
        last_s = point.t_s;
        checked(key, point.value, range);
    }
    return Profile(*points);
}

Profile TomlReader::profile_or(std::string_view key, double fallback, Range range)
{
    return has(key) ? profile(key, range) : Profile(fallback);
}

std::vector<std::pair<std::string, std::string>> TomlReader::pass_through(std::string_view section)
{
    std::vector<std::pair<std::string, std::string>> pairs;
    const std::string prefix = std::string(section) + ".";
    for (std::size_t i = 0; i < document_.entries_.size(); ++i) {
        const TomlDocument::Entry &entry = document_.entries_[i];
        if (!entry.key.starts_with(prefix)) {
            continue;
        }
        taken_[i] = 1;
        std::string name = entry.key.substr(prefix.size());
        if (const auto *number = std::get_if<double>(&entry.value)) {
            pairs.emplace_back(std::move(name), number_text(checked(entry.key, *number, {})));
        } else if (const auto *text = std::get_if<std::string>(&entry.value)) {
            pairs.emplace_back(std::move(name), *text);
        } else {
            reject_type(entry.key, entry.value, "a number or text");
        }
    }
    return pairs;
}

void TomlReader::finish() const
{
    for (std::size_t i = 0; i < taken_.size(); ++i) {
        if (taken_[i] != 0) {
            continue;
        }
        const std::string &key = document_.entries_[i].key;
        std::string known;
        for (const std::string_view candidate : known_) {
            if (section_of(candidate) == section_of(key) &&
                known.find(candidate) == std::string::npos) {
                known += (known.empty() ? "" : ", ") + std::string(candidate);
            }
        }
        reject(key, "unknown key",
               known.empty() ? "this file has no section [" + std::string(section_of(key)) + "]"
                             : "known here: " + known);
    }
}

} // namespace zh
