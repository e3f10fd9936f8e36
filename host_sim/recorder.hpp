// Signals of a run, one row of doubles per recorded step, one buffer.
#ifndef ZH_RECORDER_HPP
#define ZH_RECORDER_HPP

#include <cstddef>
#include <ostream>
#include <span>
#include <string>
#include <vector>

namespace zh {

class Recorder {
public:
    // Keeps every `every`-th row offered; `expected_rows` offered rows are reserved for.
    Recorder(std::vector<std::string> columns, std::size_t every, std::size_t expected_rows);

    // True when the row now due is wanted; advances the count. Asked once per step.
    bool due();
    // Throws std::invalid_argument when the number of values is not that of the columns.
    void push(std::span<const double> row);

    const std::vector<std::string> &columns() const
    {
        return columns_;
    }
    std::size_t rows() const
    {
        return data_.size() / columns_.size();
    }
    std::span<const double> row(std::size_t index) const
    {
        return std::span(data_).subspan(index * columns_.size(), columns_.size());
    }
    // Row-major, rows() x columns().size().
    std::span<const double> data() const
    {
        return data_;
    }
    // A copy of one column; throws std::invalid_argument for an unknown name.
    std::vector<double> column(const std::string &name) const;
    void write_csv(std::ostream &out) const;

private:
    std::vector<std::string> columns_;
    std::size_t every_;
    std::size_t offered_ = 0;
    std::vector<double> data_;
};

} // namespace zh

#endif
