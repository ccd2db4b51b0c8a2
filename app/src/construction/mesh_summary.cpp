#include "construction/mesh_summary.h"

#include <fmt/format.h>

#include <array>

#include "text/text.h"

namespace hpsdf::app {

std::string faultyEdges(const MeshReport& report) {
  return fmt::format("{} boundary, {} non-manifold and {} inconsistent edges", grouped(report.boundaryEdges),
                     grouped(report.nonManifoldEdges), grouped(report.inconsistentEdges));
}

std::string insideTestName(InsideTest sign) {
  constexpr std::array kNames = {"unknown", "pseudonormal", "winding", "unsigned-shell", "hull"};
  return kNames[std::size_t(sign)];
}

std::string closednessText(const MeshReport& report) {
  return report.closed() ? "closed" : "not closed: " + faultyEdges(report);
}

Json meshJson(const std::string& name, const MeshReport& report) {
  return {{"name", name},
          {"vertices", report.vertices},
          {"faces", report.faces},
          {"parts", report.components},
          {"closed", report.closed()},
          {"boundary_edges", report.boundaryEdges},
          {"non_manifold_edges", report.nonManifoldEdges},
          {"inconsistent_edges", report.inconsistentEdges},
          {"unbalanced_edges", report.unbalancedEdges},
          {"welded_vertices", report.weldedVertices},
          {"unreferenced_vertices", report.unreferencedVertices},
          {"degenerate_faces", report.degenerateFaces},
          {"flipped_faces", report.flippedFaces},
          {"duplicate_faces", report.duplicateFaces},
          {"degenerate_at", report.degenerateFaces > 0 ? vectorJson(report.degeneratePosition) : Json()},
          {"duplicate_at", report.duplicateFaces > 0 ? vectorJson(report.duplicatePosition) : Json()},
          {"turned", report.reversed},
          {"volume", report.volume},
          {"area", report.area},
          {"box", boxJson(report.box)}};
}

std::string meshText(const std::string& name, const MeshReport& report) {
  std::string text = name + "\n";
  const auto row = [&](std::string_view label, const std::string& value) { text += summaryRow(label, value); };
  row("vertices, faces", fmt::format("{}, {}", grouped(report.vertices), grouped(report.faces)));
  row("parts", grouped(report.components));
  row("surface", closednessText(report));
  row("volume, area", fmt::format("{:.6g}, {:.6g}", report.volume, report.area));
  row("box", boxText(report.box));
  if (report.weldedVertices > 0)
    row("welded",
        countOf(report.weldedVertices, "vertex", "vertices") + " (most readers give each corner of a face its own)");
  if (report.unreferencedVertices > 0)
    row("unused", countOf(report.unreferencedVertices, "vertex", "vertices") + " dropped");
  const auto dropped = [&](const char* kind, std::size_t faces, const Vector3& place) {
    if (faces > 0) row(kind, countOf(faces, "face", "faces") + " dropped, as at " + vectorText(place, report.box));
  };
  dropped("degenerate", report.degenerateFaces, report.degeneratePosition);
  if (report.flippedFaces > 0)
    row("flipped", countOf(report.flippedFaces, "edge of a face without area that holds its neighbours",
                           "edges of faces without area that hold their neighbours"));
  dropped("duplicate", report.duplicateFaces, report.duplicatePosition);
  if (report.reversed) row("turned", "the whole mesh: its faces looked inward");
  return text;
}

std::string reasonText(const InsideTestChoice& choice, const Box& mesh) {
  return choice.position ? choice.reason + ", as at " + vectorText(*choice.position, mesh) : choice.reason;
}

}  // namespace hpsdf::app
