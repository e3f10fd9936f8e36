// A quantity over time as a polyline; two points at the same time are a step.
#ifndef ZH_PROFILE_HPP
#define ZH_PROFILE_HPP

#include <cstddef>
#include <vector>

namespace zh {

struct ProfilePoint {
    double t_s;
    double value;
};

// Constant before the first and after the last point; at a step the later value holds.
class Profile {
public:
    explicit Profile(double constant = 0.0);
    // Times must not decrease, and at least one point is needed: throws std::invalid_argument.
    explicit Profile(std::vector<ProfilePoint> points);

    double value(double t_s) const;
    // The same for a caller who mostly goes forward; `cursor` starts at 0 and belongs to the
    // caller.
    double value(double t_s, std::size_t &cursor) const
    {
        return points_.size() == 1 ? points_[0].value : seek(t_s, cursor);
    }
    bool constant() const
    {
        return points_.size() == 1;
    }
    // Until when value(t_s) does not change; t_s itself on a slope.
    double holds_until(double t_s) const;
    // On a slope, until when it goes on; elsewhere t_s itself.
    double slopes_until(double t_s) const;
    const std::vector<ProfilePoint> &points() const
    {
        return points_;
    }

private:
    double seek(double t_s, std::size_t &cursor) const;

    std::vector<ProfilePoint> points_;
};

} // namespace zh

#endif
