#include "reduce_contacts.h"

#include <algorithm>
#include <limits>

namespace hpsdf::physics {

void reduceContacts(std::size_t most, double size, std::vector<BodyContact>& contacts) {
  if (contacts.size() <= most) return;
  std::iter_swap(contacts.begin(), std::ranges::min_element(contacts, {}, &BodyContact::distance));
  thread_local std::vector<double> squares;  // squared distance of each contact from the nearest chosen one
  squares.assign(contacts.size(), std::numeric_limits<double>::infinity());
  for (std::size_t chosen = 1; chosen < most; ++chosen) {
    const BodyContact& last = contacts[chosen - 1];
    std::size_t farthest = chosen;
    for (std::size_t i = chosen; i < contacts.size(); ++i) {
      const double square = (contacts[i].onSecond - last.onSecond).squaredNorm() +
                            size * size * (contacts[i].normal - last.normal).squaredNorm();
      squares[i] = std::min(squares[i], square);
      if (squares[i] > squares[farthest]) farthest = i;
    }
    std::swap(contacts[chosen], contacts[farthest]);
    std::swap(squares[chosen], squares[farthest]);
  }
  contacts.resize(most);
}

}  // namespace hpsdf::physics
