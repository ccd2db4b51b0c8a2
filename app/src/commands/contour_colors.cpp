#include "commands/contour_colors.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "hpsdf/mesh_file.h"
#include "pictures/picture_arguments.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// The parameters of `render` that `contour` has too.
constexpr std::array kShared = {"range", "scale", "map", "mesh", "other"};

}  // namespace

std::vector<Parameter> vertexColorParameters(const Registry& registry) {
  std::vector<std::string> names = colorNames(render::ColorBy::normal);
  std::erase(names, colorName(render::ColorBy::distance));
  std::vector<Parameter> parameters = {
      {"color", choice(names),
       "Colours the vertices in the colours of pictures: by the degree or depth of the cells that hold them, or by a "
       "quantity at the vertices, as 'render --color' does. Files of .ply, .glb and .obj hold colours. Give range to "
       "compare files. Without this option the file has no colours."}};
  for (const char* name : kShared) parameters.push_back(*findParameter(registry.command("render"), name));
  return under(kColours, std::move(parameters));
}

void checkVertexColors(const Arguments& arguments, const std::string& file) {
  if (arguments.given("color")) {
    if (!holdsVertexData(file))
      throw Error(fmt::format("color: {} would hold no colours; write .ply, .glb or .obj", file));
    scaleOptions(arguments);
    return;
  }
  for (const char* name : kShared)
    if (arguments.given(name)) throw Error(fmt::format("{}: needs color, whose colours it changes", name));
}

render::ReferenceData vertexColorData(Session& session, const Arguments& arguments) {
  if (!arguments.given("color")) return {};
  return session.reference(colorNamed(arguments.text("color")), arguments.textOr("mesh", ""),
                           arguments.textOr("other", ""));
}

std::optional<render::PointColors> vertexColors(const Arguments& arguments, const Field& field,
                                                const TriangleMesh& mesh, const render::ReferenceData& data) {
  if (!arguments.given("color")) return std::nullopt;
  return render::pointColors(field, mesh.vertices, colorNamed(arguments.text("color")), scaleOptions(arguments), data);
}

std::string vertexColorText(const Arguments& arguments, const render::PointColors& colors) {
  const std::string name = arguments.text("color");
  if (!colors.scale.limits) return name;
  return fmt::format("{} from {} to {}{}", name, shortNumber((*colors.scale.limits)[0]),
                     shortNumber((*colors.scale.limits)[1]), colors.scale.logarithmic ? ", logarithmic" : "");
}

Json vertexColorJson(const Arguments& arguments, const std::optional<render::PointColors>& colors) {
  if (!colors) return {};
  Json json = {{"by", arguments.text("color")}};
  if (colors->scale.limits) {
    json["range"] = *colors->scale.limits;
    json["scale"] = colors->scale.logarithmic ? "log" : "linear";
  } else {
    json["levels"] = colors->scale.levels;
  }
  return json;
}

}  // namespace hpsdf::app
