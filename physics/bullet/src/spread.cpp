#include "spread.h"

#include <algorithm>
#include <limits>

namespace hpsdf::physics {

void spread(std::size_t most, double size, std::vector<BodyContact>& contacts) {
  if (contacts.size() <= most) return;
  std::iter_swap(contacts.begin(), std::ranges::min_element(contacts, {}, &BodyContact::distance));
  thread_local std::vector<double> away;  // of each contact from the nearest that is chosen
  away.assign(contacts.size(), std::numeric_limits<double>::infinity());
  for (std::size_t chosen = 1; chosen < most; ++chosen) {
    const BodyContact& last = contacts[chosen - 1];
    std::size_t farthest = chosen;
    for (std::size_t i = chosen; i < contacts.size(); ++i) {
      const double here = (contacts[i].onSecond - last.onSecond).squaredNorm() +
                          size * size * (contacts[i].normal - last.normal).squaredNorm();
      away[i] = std::min(away[i], here);
      if (away[i] > away[farthest]) farthest = i;
    }
    std::swap(contacts[chosen], contacts[farthest]);
    std::swap(away[chosen], away[farthest]);
  }
  contacts.resize(most);
}

}  // namespace hpsdf::physics
