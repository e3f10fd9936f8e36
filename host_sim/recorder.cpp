#include "recorder.hpp"

#include <algorithm>
#include <charconv>
#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace zh {

Recorder::Recorder(std::vector<std::string> columns, std::size_t every, std::size_t expected_rows)
    : columns_(std::move(columns)), every_(every)
{
    if (columns_.empty() || every_ == 0) {
        throw std::invalid_argument("a recorder needs columns and a decimation of at least 1");
    }
    data_.reserve((expected_rows / every_ + 1) * columns_.size());
}

bool Recorder::due()
{
    return offered_++ % every_ == 0;
}

void Recorder::push(std::span<const double> row)
{
    if (row.size() != columns_.size()) {
        throw std::invalid_argument("a row needs one value per column");
    }
    data_.insert(data_.end(), row.begin(), row.end());
}

std::vector<double> Recorder::column(const std::string &name) const
{
    const auto at = std::find(columns_.begin(), columns_.end(), name);
    if (at == columns_.end()) {
        throw std::invalid_argument("no column '" + name + "' was recorded");
    }
    std::vector<double> values;
    values.reserve(rows());
    const auto offset = static_cast<std::size_t>(at - columns_.begin());
    for (std::size_t i = offset; i < data_.size(); i += columns_.size()) {
        values.push_back(data_[i]);
    }
    return values;
}

void Recorder::write_csv(std::ostream &out) const
{
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        out << (c == 0 ? "" : ",") << columns_[c];
    }
    out << '\n';
    std::array<char, 32> buffer{};
    for (std::size_t i = 0; i < data_.size(); ++i) {
        const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), data_[i]);
        out.write(buffer.data(), end.ptr - buffer.data());
        out << ((i + 1) % columns_.size() == 0 ? '\n' : ',');
    }
}

} // namespace zh
