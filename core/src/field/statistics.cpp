#include "hpsdf/field.h"

namespace hpsdf {

FieldStatistics statistics(const Field& field) {
  FieldStatistics s;
  const double domainVolume = (field.domain().max() - field.domain().min()).prod();
  field.forEachCell([&](const Cell& cell) {
    const double share = (cell.box.max() - cell.box.min()).prod() / domainVolume;
    ++s.leaves;
    ++s.degreeLeaves[cell.degree];
    ++s.depthLeaves[cell.depth];
    s.degreeVolume[cell.degree] += share;
    s.depthVolume[cell.depth] += share;
  });
  s.nodes = field.data().nodes.size();
  s.bytes = field.bytes();
  s.coefficients = std::visit([](const auto& c) { return c.size(); }, field.data().coefficients);
  return s;
}

}  // namespace hpsdf
