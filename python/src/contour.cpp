#include "contour.h"

#include <memory>
#include <string>
#include <utility>

#include "convert/waiting.h"
#include "hpsdf/output/contour.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

DomainCut domainCutOf(const std::string& word) {
  if (word != "wall" && word != "open")
    throw Error(ErrorKind::option, "domain_cut", "expected 'wall' or 'open', got '" + word + "'");
  return word == "wall" ? DomainCut::wall : DomainCut::open;
}

/// Issues a `RuntimeWarning` if the mesh is not all that was asked for.
void warnOfMisses(const Contour& made) {
  std::string text;
  if (made.flawed > 0)
    text = std::to_string(made.flawed) + " polygons of the contour cross others: try another tolerance";
  else if (made.unresolved > 0)
    text = "the contour misses the tolerance in " + std::to_string(made.unresolved) +
           " places: allow a greater tolerance, or build the field more accurately";
  if (!text.empty() && PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

std::shared_ptr<TriangleMesh> contourOf(const Field& field, double offset, double tolerance,
                                        const std::string& domainCut, bool simplify, bool keepJumps, int threads,
                                        const py::object& progress) {
  const ContourOptions options = {.offset = offset,
                                  .tolerance = tolerance,
                                  .domainCut = domainCutOf(domainCut),
                                  .simplify = simplify,
                                  .threads = threads};
  Contour made = resultOf(progress, [&](const Progress& link) {
    return keepJumps ? contour(field, options, link) : blendedContour(field, options, link);
  });
  warnOfMisses(made);
  return std::make_shared<TriangleMesh>(std::move(made.mesh));
}

}  // namespace

void addContour(FieldClass& fields) {
  fields.def(
      "contour", &contourOf, py::kw_only(), "offset"_a = 0.0, "tolerance"_a = 0.0, "domain_cut"_a = "wall",
      "simplify"_a = false, "keep_jumps"_a = false, "threads"_a = 0, "progress"_a = py::none(),
      "Returns the mesh of the surface on which the field has the value `offset`, in units of length: closed and "
      "without crossings, with sharp edges kept. Where the surface has steps between cells, it is that of a blended "
      "copy of the field, from which the field differs by as much as it jumps.\n\n"
      "tolerance: greatest distance between the mesh and this surface; 0 for a thousandth of the domain's longest "
      "side. domain_cut: 'wall' closes the mesh where the domain cuts the solid, 'open' ends it there. simplify: "
      "merges vertices as far as the tolerance allows, which takes several times as long. "
      "keep_jumps: follows the steps instead, which takes longer and may need much memory.\n\n"
      "Issues a RuntimeWarning where the mesh misses the tolerance.\n\n"
      "Raises Error for options out of range and LimitError (a MemoryError).");
}

}  // namespace hpsdf::python
