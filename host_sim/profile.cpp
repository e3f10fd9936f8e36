#include "profile.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace zh {

Profile::Profile(double constant) : points_{{0.0, constant}}
{
}

Profile::Profile(std::vector<ProfilePoint> points) : points_(std::move(points))
{
    if (points_.empty()) {
        throw std::invalid_argument("a profile needs at least one point");
    }
    for (std::size_t i = 1; i < points_.size(); ++i) {
        if (!(points_[i].t_s >= points_[i - 1].t_s)) {
            throw std::invalid_argument("the times of a profile must not decrease");
        }
    }
}

double Profile::value(double t_s) const
{
    std::size_t cursor = 0;
    return value(t_s, cursor);
}

double Profile::holds_until(double t_s) const
{
    if (t_s < points_.front().t_s) {
        return points_.front().t_s;
    }
    std::size_t n = 0;
    (void)value(t_s, n);
    double until_s = t_s;
    for (; n + 1 < points_.size() && !(std::abs(points_[n + 1].value - points_[n].value) > 0.0);
         ++n) {
        until_s = points_[n + 1].t_s;
    }
    return n + 1 == points_.size() ? std::numeric_limits<double>::infinity() : until_s;
}

double Profile::slopes_until(double t_s) const
{
    std::size_t n = 0;
    (void)value(t_s, n);
    const bool slope = points_[n].t_s <= t_s && n + 1 < points_.size() &&
                       std::abs(points_[n + 1].value - points_[n].value) > 0.0;
    return slope ? points_[n + 1].t_s : t_s;
}

// The cursor is the last point at or before t.
double Profile::seek(double t_s, std::size_t &cursor) const
{
    while (cursor > 0 && points_[cursor].t_s > t_s) {
        --cursor;
    }
    while (cursor + 1 < points_.size() && points_[cursor + 1].t_s <= t_s) {
        ++cursor;
    }
    const ProfilePoint &left = points_[cursor];
    if (t_s <= left.t_s || cursor + 1 == points_.size()) {
        return left.value;
    }
    const ProfilePoint &right = points_[cursor + 1];
    return left.value + (right.value - left.value) * ((t_s - left.t_s) / (right.t_s - left.t_s));
}

} // namespace zh
