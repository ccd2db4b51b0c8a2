#include "vector/paths.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace hpsdf::render {
namespace {

std::uint64_t bucketOf(double column, double row) {
  const auto x = static_cast<std::uint64_t>(static_cast<std::int64_t>(column));
  const auto y = static_cast<std::uint64_t>(static_cast<std::int64_t>(row));
  return x * 0x9e3779b97f4a7c15 ^ y;
}

/// Takes links one after the other out of a set of links, along their common points.
class LinkWalk {
 public:
  LinkWalk(std::span<const Link> links, std::size_t points)
      : links_(links), used_(links.size(), false), ofPoint_(points) {
    for (std::size_t n = 0; n < links.size(); ++n)
      for (const int point : links[n]) ofPoint_[std::size_t(point)].push_back(n);
  }

  /// Returns true if an odd number of links meet at the point, so that a line must end there.
  bool isEnd(int point) const { return ofPoint_[std::size_t(point)].size() % 2 == 1; }

  /// Follows links that are not used yet from a point until it is reached again or no link leads on.
  std::vector<int> from(int start) {
    std::vector<int> path = {start};
    while (const std::optional<int> next = step(path.back())) {
      path.push_back(*next);
      if (*next == start) break;
    }
    return path;
  }

 private:
  std::optional<int> step(int point) {
    std::vector<std::size_t>& links = ofPoint_[std::size_t(point)];
    while (!links.empty() && used_[links.back()]) links.pop_back();
    if (links.empty()) return std::nullopt;
    const std::size_t n = links.back();
    used_[n] = true;
    return links_[n][0] == point ? links_[n][1] : links_[n][0];
  }

  std::span<const Link> links_;
  std::vector<bool> used_;
  std::vector<std::vector<std::size_t>> ofPoint_;
};

/// Distance of x from the straight line between a and b.
double distanceFromChord(const Eigen::Vector2d& x, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((x - a).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (x - a - t * along).norm();
}

}  // namespace

int PointNumbers::operator()(const Eigen::Vector2d& point) {
  const double column = std::floor(point.x() / kSamePoint), row = std::floor(point.y() / kSamePoint);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const auto found = buckets_.find(bucketOf(column + dx, row + dy));
      if (found == buckets_.end()) continue;
      for (const int n : found->second)
        if ((points_[std::size_t(n)] - point).norm() < kSamePoint) return n;
    }
  points_.push_back(point);
  const int number = static_cast<int>(points_.size()) - 1;
  buckets_[bucketOf(column, row)].push_back(number);
  return number;
}

std::vector<Polyline> joinedLinks(std::span<const Link> links, const std::vector<Eigen::Vector2d>& points) {
  LinkWalk walk(links, points.size());
  std::vector<Polyline> lines;
  const auto walkFrom = [&](int start) {
    for (std::vector<int> path = walk.from(start); path.size() > 1; path = walk.from(start)) {
      Polyline& line = lines.emplace_back();
      for (const int point : path) line.push_back(points[std::size_t(point)]);
    }
  };
  // Start at the ends of open lines, because a walk from elsewhere would split them. Only closed lines are left then.
  std::vector<int> ends;
  for (const Link& link : links)
    for (const int point : link)
      if (walk.isEnd(point)) ends.push_back(point);
  for (const int end : ends) walkFrom(end);
  for (const Link& link : links) walkFrom(link[0]);
  return lines;
}

Polyline simplified(const Polyline& line, double tolerance) {
  if (line.size() < 3) return line;
  std::vector<bool> kept(line.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> parts = {{0, line.size() - 1}};
  while (!parts.empty()) {
    const auto [first, last] = parts.back();
    parts.pop_back();
    std::size_t farthest = first;
    double distance = tolerance;
    for (std::size_t n = first + 1; n < last; ++n)
      if (const double here = distanceFromChord(line[n], line[first], line[last]); here > distance) {
        distance = here;
        farthest = n;
      }
    if (farthest == first) continue;
    kept[farthest] = true;
    parts.emplace_back(first, farthest);
    parts.emplace_back(farthest, last);
  }
  Polyline result;
  for (std::size_t n = 0; n < line.size(); ++n)
    if (kept[n]) result.push_back(line[n]);
  return result;
}

}  // namespace hpsdf::render
