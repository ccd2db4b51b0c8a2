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
  s.bytes = s.nodes * sizeof(field.data().nodes[0]);
  std::visit(
      [&](const auto& c) {
        s.coefficients = c.size();
        s.bytes += c.size() * sizeof(c[0]);
      },
      field.data().coefficients);
  return s;
}

}  // namespace hpsdf
