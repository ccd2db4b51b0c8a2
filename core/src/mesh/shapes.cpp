#include "hpsdf/shapes.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"

namespace hpsdf::shapes {
namespace {

constexpr double kPi = std::numbers::pi;
// The smallest and the greatest length that a caller may give. The ratio of these two limits is small enough for all
// parts of a shape to be accurate in double precision.
constexpr double kShortest = 1e-3, kLongest = 1e3;

Parameter length(std::string name, double defaultValue, std::string help) {
  return {std::move(name), defaultValue, kShortest, kLongest, false, std::move(help)};
}

Parameter count(std::string name, double defaultValue, double minimum, double maximum, std::string help) {
  return {std::move(name), defaultValue, minimum, maximum, true, std::move(help)};
}

const std::vector<Shape>& shapeList() {
  // The maxima of the whole-number parameters keep every mesh below some 8 million faces.
  static const std::vector<Shape> list = {
      {"sphere",
       "an icosahedron subdivided towards a sphere",
       {length("radius", 1, "radius"),
        count("subdivisions", 6, 0, 9, "times that each of 20 faces is divided into four")},
       true},
      {"torus",
       "a ring around the axis z",
       {length("major", 0.7, "radius of the ring's centre line"),
        length("minor", 0.3, "radius of the tube, below major"),
        count("segments", 256, 3, 4096, "steps around the axis"),
        count("sides", 128, 3, 1024, "steps around the tube")},
       true},
      {"box",
       "a box of twelve triangles",
       {length("width", 2, "full size along x"), length("height", 1.5, "full size along y"),
        length("depth", 1, "full size along z")},
       true},
      {"gear",
       "a spur gear with a bore, along the axis z",
       {count("teeth", 12, 3, 500, "number of teeth"), length("radius", 1, "outer radius, at the tips"),
        length("tooth-depth", 0.22, "height of the teeth, from root to tip"), length("hole", 0.3, "radius of the bore"),
        length("thickness", 0.5, "full size along z"),
        count("segments", 8, 1, 64,
              "steps along each tip and each root; an even number puts a corner in the middle of a tip")},
       false},
      {"helix-bowl",
       "a bowl, open towards +z, with a groove that runs down in a spiral; 329k faces with cells=143",
       {length("radius", 1, "outer radius of the opening"), length("height", 0.8, "outer height of the bowl"),
        length("thickness", 0.1, "thickness of the wall beside the groove"),
        length("depth", 0.06, "depth of the groove, below thickness"),
        count("turns", 4, 1, 64, "turns of the groove around the axis"),
        count("cells", 48, 8, 700, "cells of the mesh from the middle to the edge")},
       false},
      {"marble-run",
       "a channel, open towards +z, that winds down around the axis z; 53k faces with steps=255,sides=12",
       {length("radius", 1, "outer radius of the turns"), length("height", 1, "height by which it descends"),
        length("width", 0.16, "outer width of the channel"),
        length("thickness", 0.02, "thickness of its wall, below half of the width"),
        count("turns", 4, 1, 64, "turns around the axis"), count("steps", 96, 8, 1024, "steps in a turn"),
        count("sides", 8, 2, 64, "steps around the channel's half circle")},
       false},
      {"structured-bowl",
       "a bowl, open towards +z, with fine bumps all over its inside; 4.1M faces with cells=506,bumps=40",
       {length("radius", 1, "outer radius of the opening"), length("height", 0.8, "outer height of the bowl"),
        length("thickness", 0.1, "thickness of the wall under the highest bumps"),
        length("depth", 0.03, "height of the bumps from valley to top, below thickness"),
        count("bumps", 8, 1, 200, "bumps across the bowl, each with smaller bumps on it"),
        count("cells", 48, 8, 700, "cells of the mesh from the middle to the edge")},
       false},
  };
  return list;
}

// ---------------------------------------------------------------------------------------------------------------------
// Parsing of shape specifications such as "torus,minor=0.2"

/// Returns the end of an error message about an unknown name: it suggests the most similar name in the list, or
/// lists all names.
template <typename List>
std::string suggestion(std::string_view wanted, const List& list) {
  std::vector<std::string> names;
  std::string all;
  for (const auto& item : list) {
    names.push_back(item.name);
    all += (all.empty() ? "" : ", ") + item.name;
  }
  return "; " + didYouMean(wanted, names, "known: " + all);
}

std::string format(double x) {
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), x);
  return {text.data(), end};
}

/// A parsed shape specification: the shape and the value of each of its parameters.
struct Request {
  std::string spec;  ///< the spec as the caller wrote it
  std::string text;  ///< the spec without its prefix "builtin:" or "analytic:"
  const Shape* shape = nullptr;
  std::map<std::string, double, std::less<>> values = {};

  double operator[](std::string_view name) const { return values.find(name)->second; }
  unsigned whole(std::string_view name) const { return static_cast<unsigned>((*this)[name]); }
  [[noreturn]] void fail(const std::string& problem) const { throw Error(ErrorKind::option, spec, problem); }
};

double parseValue(const Request& request, const Parameter& parameter, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
      (parameter.whole && value != std::floor(value)))
    request.fail(parameter.name + "='" + std::string(text) + "' is not a " + (parameter.whole ? "whole " : "") +
                 "number; give one like " + parameter.name + "=" + format(parameter.defaultValue));
  if (value < parameter.minimum || value > parameter.maximum)
    request.fail(parameter.name + "=" + std::string(text) + " is out of range; give " + format(parameter.minimum) +
                 " to " + format(parameter.maximum));
  return value;
}

/// Parses one item "parameter=value" and stores the value in `request`.
void assign(Request& request, std::string_view item) {
  const std::size_t equals = item.find('=');
  const std::string_view name = trimmed(item.substr(0, equals));
  const std::vector<Parameter>& known = request.shape->parameters;
  const auto parameter = std::ranges::find(known, name, &Parameter::name);
  if (parameter == known.end())
    request.fail(request.shape->name + " has no parameter '" + std::string(name) + "'" + suggestion(name, known));
  if (equals == std::string_view::npos)
    request.fail(parameter->name + " has no value; write " + parameter->name + "=" + format(parameter->defaultValue));
  if (request.values.contains(name)) request.fail(parameter->name + " is given twice; give it once");
  request.values[parameter->name] = parseValue(request, *parameter, trimmed(item.substr(equals + 1)));
}

/// Returns the factor by which a regular polygon of n corners, inscribed in a circle, must be scaled to have the
/// circle's area.
double equalAreaFactor(double n) { return std::sqrt((2 * kPi / n) / std::sin(2 * kPi / n)); }

void requireSoundBowl(const Request& request) {
  if (request["depth"] >= request["thickness"])
    request.fail("the relief cuts through the wall; make depth smaller than thickness");
  // The outer side of the bowl is a paraboloid. The inner side does not intersect itself if the wall is thinner
  // than the paraboloid's smallest radius of curvature, which is radius²/(2·height) at the lowest point.
  if (request["thickness"] >= request["radius"] * request["radius"] / (2 * request["height"]))
    request.fail("the wall is thicker than the bowl is wide at its bottom; make thickness or height smaller");
}

void requireSoundRun(const Request& request) {
  if (request["thickness"] >= request["width"] / 2)
    request.fail("the wall fills the channel; make thickness smaller than half of the width");
  if (request["width"] >= request["radius"]) request.fail("the channel meets the axis; make width smaller than radius");
  if (request["turns"] > 1 && request["height"] / request["turns"] <= request["width"] / 2)
    request.fail("the turns meet; make height larger, or turns or width smaller");
}

/// Throws `Error` for parameters that contradict each other although each is within its range.
void requireSoundProportions(const Request& request) {
  if (request.shape->name.ends_with("-bowl")) requireSoundBowl(request);
  if (request.shape->name == "marble-run") requireSoundRun(request);
  if (request.shape->name == "torus") {
    if (request["minor"] >= request["major"]) request.fail("the tube meets the axis; make minor smaller than major");
    if (request["minor"] * equalAreaFactor(request["sides"]) >= request["major"])
      request.fail("a tube with so few sides meets the axis; make minor smaller or sides larger");
  }
  if (request.shape->name == "gear") {
    if (request["tooth-depth"] >= request["radius"])
      request.fail("the teeth reach the axis; make tooth-depth smaller than radius");
    if (request["hole"] >= request["radius"] - request["tooth-depth"])
      request.fail("the bore cuts the roots of the teeth; make hole smaller than radius - tooth-depth");
  }
}

Request parse(std::string_view spec, std::string_view prefix) {
  std::string_view rest = trimmed(spec);
  if (rest.starts_with(prefix)) rest.remove_prefix(prefix.size());
  Request request{.spec = std::string(spec), .text = std::string(rest)};

  std::size_t comma = rest.find(',');
  const std::string_view name = trimmed(rest.substr(0, comma));
  const std::vector<Shape>& list = shapeList();
  const auto shape = std::ranges::find(list, name, &Shape::name);
  if (shape == list.end()) request.fail("there is no shape '" + std::string(name) + "'" + suggestion(name, list));
  request.shape = &*shape;
  while (comma != std::string_view::npos) {
    rest.remove_prefix(comma + 1);
    comma = rest.find(',');
    assign(request, rest.substr(0, comma));
  }
  for (const Parameter& parameter : shape->parameters)
    request.values.try_emplace(parameter.name, parameter.defaultValue);
  requireSoundProportions(request);
  return request;
}

// ---------------------------------------------------------------------------------------------------------------------
// Construction of the meshes

/// Returns point `i` of `n` equally spaced points on the unit circle. Points on the axes are exact, so that
/// bounding boxes and symmetry planes of the shapes are exact too.
Eigen::Vector2d onCircle(double i, double n) {
  const double quarters = 4 * i / n;
  if (quarters == std::floor(quarters)) {
    static const std::array<Eigen::Vector2d, 4> axes = {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1),
                                                        Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, -1)};
    return axes[static_cast<std::size_t>(((static_cast<long>(quarters) % 4) + 4) % 4)];
  }
  const double angle = 2 * kPi * i / n;
  return {std::cos(angle), std::sin(angle)};
}

void addQuad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

TriangleMesh icosahedron() {
  const double phi = std::numbers::phi;  // With these vertices, six edges have midpoints on the coordinate axes.
  TriangleMesh mesh;
  mesh.vertices = {{-1, phi, 0},  {1, phi, 0},  {-1, -phi, 0}, {1, -phi, 0}, {0, -1, phi},  {0, 1, phi},
                   {0, -1, -phi}, {0, 1, -phi}, {phi, 0, -1},  {phi, 0, 1},  {-phi, 0, -1}, {-phi, 0, 1}};
  // Two vertices are joined by an edge if their distance is 2, the edge length. Three vertices form a face if every two
  // of them are joined.
  const auto joined = [&](std::uint32_t a, std::uint32_t b) {
    return (mesh.vertices[a] - mesh.vertices[b]).norm() < 2.1;
  };
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = a + 1; b < 12; ++b)
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!joined(a, b) || !joined(b, c) || !joined(c, a)) continue;
        const Vector3& p = mesh.vertices[a];
        const bool outward = p.dot(mesh.vertices[b].cross(mesh.vertices[c])) > 0;
        mesh.triangles.push_back(outward ? std::array{a, b, c} : std::array{a, c, b});
      }
  for (Vector3& v : mesh.vertices) v.normalize();
  return mesh;
}

/// Divides every triangle into four. The new vertices are midpoints of edges, moved to the unit sphere.
void subdivide(TriangleMesh& mesh) {
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  middles.reserve(3 * mesh.triangles.size() / 2);
  mesh.vertices.reserve(mesh.vertices.size() + 3 * mesh.triangles.size() / 2);
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [low, high] = std::minmax(a, b);
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto [entry, isNew] = middles.try_emplace(std::uint64_t{low} << 32 | high, next);
    if (isNew) mesh.vertices.push_back((mesh.vertices[low] + mesh.vertices[high]).normalized());
    return entry->second;
  };
  std::vector<std::array<std::uint32_t, 3>> finer;
  finer.reserve(4 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  mesh.triangles = std::move(finer);
}

// The sphere mesh and the torus mesh are scaled to the volume of the smooth shape. If the vertices lay on the
// sphere, every face would lie inside it, by up to the face's sagitta. With equal volumes the deviations cancel
// on average, and their RMS is a third as large.

TriangleMesh sphereMesh(const Request& request) {
  TriangleMesh mesh = icosahedron();
  for (unsigned i = 0; i < request.whole("subdivisions"); ++i) subdivide(mesh);
  const double scale = request["radius"] * std::cbrt(4 * kPi / 3 / signedVolume(mesh));
  for (Vector3& v : mesh.vertices) v *= scale;
  return mesh;
}

TriangleMesh torusMesh(const Request& request) {
  const std::uint32_t segments = request.whole("segments");
  const std::uint32_t sides = request.whole("sides");
  // By Pappus's theorem the mesh has the torus's volume if the polygon around the tube and the polygon around the
  // axis have the areas of the circles that they approximate.
  const double tube = request["minor"] * equalAreaFactor(sides);
  const double around = equalAreaFactor(segments);
  TriangleMesh mesh;
  mesh.vertices.reserve(std::size_t{segments} * sides);
  mesh.triangles.reserve(std::size_t{2} * segments * sides);
  for (std::uint32_t i = 0; i < segments; ++i) {
    const Eigen::Vector2d direction = onCircle(i, segments);
    for (std::uint32_t j = 0; j < sides; ++j) {
      const Eigen::Vector2d section = tube * onCircle(j, sides);
      const double fromAxis = around * (request["major"] + section.x());
      mesh.vertices.emplace_back(fromAxis * direction.x(), fromAxis * direction.y(), section.y());
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return (i % segments) * sides + j % sides; };
  for (std::uint32_t i = 0; i < segments; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) addQuad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  return mesh;
}

Vector3 boxHalfSize(const Request& request) {
  return Vector3(request["width"], request["height"], request["depth"]) / 2;
}

TriangleMesh boxMesh(const Request& request) {
  const Vector3 half = boxHalfSize(request);
  TriangleMesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner)  // The bits of `corner` select the sides along x, y and z.
    mesh.vertices.emplace_back(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                               corner & 4 ? half.z() : -half.z());
  addQuad(mesh, 0, 4, 6, 2);  // the side at -x
  addQuad(mesh, 1, 3, 7, 5);  // the side at +x
  addQuad(mesh, 0, 1, 5, 4);  // the side at -y
  addQuad(mesh, 2, 6, 7, 3);  // the side at +y
  addQuad(mesh, 0, 2, 3, 1);  // the side at -z
  addQuad(mesh, 4, 5, 7, 6);  // the side at +z
  return mesh;
}

/// A corner of the gear's outline.
struct OutlinePoint {
  double turn;    ///< angle about the axis, in tooth pitches
  double radius;  ///< distance from the axis
};

/// Returns the corners of a gear's outline counter-clockwise. The tip of a tooth takes 0.26 of the tooth's pitch,
/// each of the two straight flanks 0.13, and the root the rest. The angle grows from corner to corner, so that
/// each corner of the outline has a counterpart on the bore at the same angle.
std::vector<OutlinePoint> gearOutline(unsigned teeth, unsigned segments, double tip, double root) {
  constexpr double kTip = 0.26;
  constexpr double kFlank = 0.13;
  constexpr double kRoot = 1 - kTip - 2 * kFlank;
  std::vector<OutlinePoint> outline;
  outline.reserve(std::size_t{teeth} * 2 * (segments + 1));
  for (unsigned tooth = 0; tooth < teeth; ++tooth) {
    for (unsigned s = 0; s <= segments; ++s) outline.push_back({tooth + kTip * (double(s) / segments - 0.5), tip});
    for (unsigned s = 0; s <= segments; ++s)
      outline.push_back({tooth + 0.5 + kRoot * (double(s) / segments - 0.5), root});
  }
  return outline;
}

TriangleMesh gearMesh(const Request& request) {
  const double tip = request["radius"];
  const double top = request["thickness"] / 2;
  const unsigned teeth = request.whole("teeth");
  TriangleMesh mesh;
  for (const OutlinePoint& p : gearOutline(teeth, request.whole("segments"), tip, tip - request["tooth-depth"])) {
    const Eigen::Vector2d direction = onCircle(p.turn, teeth);
    for (const double radius : {p.radius, request["hole"]})
      for (const double z : {-top, top}) mesh.vertices.emplace_back(radius * direction.x(), radius * direction.y(), z);
  }
  const auto corners = static_cast<std::uint32_t>(mesh.vertices.size());
  for (std::uint32_t a = 0; a < corners; a += 4) {  // Each angle has four vertices: bottom and top of outline and bore.
    const std::uint32_t b = (a + 4) % corners;
    addQuad(mesh, a, b, b + 1, a + 1);          // wall along the outline
    addQuad(mesh, a + 1, b + 1, b + 3, a + 3);  // top
    addQuad(mesh, a + 3, b + 3, b + 2, a + 2);  // wall of the bore
    addQuad(mesh, a + 2, b + 2, b, a);          // bottom
  }
  return mesh;
}

/// Returns the mesh translated so that its bounding box is centred at the origin.
TriangleMesh centred(TriangleMesh mesh) {
  const Vector3 center = boundingBox(mesh).center();
  for (Vector3& v : mesh.vertices) v -= center;
  return mesh;
}

/// Maps a point of the square [-1, 1]² to the unit disc. The cells of a grid on the square keep about the
/// same size: the map has no pole at which cells would shrink.
Eigen::Vector2d onDisc(double x, double y) { return {x * std::sqrt(1 - y * y / 2), y * std::sqrt(1 - x * x / 2)}; }

/// Returns the closed mesh of a wall between two surfaces over the unit disc. The functions `inside` and `outside` map
/// points of the disc to the upper and the lower surface. A strip connects the boundaries of the surfaces.
template <typename Sheet>
TriangleMesh wallMesh(std::uint32_t cells, const Sheet& inside, const Sheet& outside) {
  const std::uint32_t n = 2 * cells, row = n + 1, sheet = row * row;
  TriangleMesh mesh;
  mesh.vertices.reserve(std::size_t{2} * sheet);
  mesh.triangles.reserve(std::size_t{4} * n * n + std::size_t{8} * n);
  for (const Sheet& positionAt : {inside, outside})
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i)
        mesh.vertices.push_back(positionAt(onDisc((double(i) - cells) / cells, (double(j) - cells) / cells)));
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::array<std::uint32_t, 4> at = {j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i};
      // The diagonal of each cell points towards the nearest corner of the square. In a corner cell, the other diagonal
      // would cut off a triangle with two sides on the boundary. This triangle would become a sliver on the disc.
      const std::uint32_t first = (i < cells) == (j < cells) ? 0 : 1;
      const auto corner = [&](std::uint32_t k) { return at[(first + k) % 4]; };
      addQuad(mesh, corner(0), corner(1), corner(2), corner(3));
      addQuad(mesh, sheet + corner(0), sheet + corner(3), sheet + corner(2), sheet + corner(1));
    }
  std::vector<std::uint32_t> boundary;  // vertices of the boundary, counter-clockwise from (-1, -1)
  for (std::uint32_t k = 0; k < n; ++k) boundary.push_back(k);
  for (std::uint32_t k = 0; k < n; ++k) boundary.push_back(k * row + n);
  for (std::uint32_t k = 0; k < n; ++k) boundary.push_back(n * row + n - k);
  for (std::uint32_t k = 0; k < n; ++k) boundary.push_back((n - k) * row);
  for (std::uint32_t k = 0; k < 4 * n; ++k) {
    const std::uint32_t here = boundary[k], next = boundary[(k + 1) % (4 * n)];
    addQuad(mesh, next, here, sheet + here, sheet + next);
  }
  return mesh;
}

/// Returns the mesh of a bowl with a paraboloid as its outer side. The wall's thickness is the parameter
/// `thickness` minus the parameter `depth` times relief(point of the unit disc).
template <typename Relief>
TriangleMesh bowlMesh(const Request& request, const Relief& relief) {
  const double radius = request["radius"], height = request["height"];
  using Sheet = std::function<Vector3(const Eigen::Vector2d&)>;
  const Sheet outside = [&](const Eigen::Vector2d& d) {
    return Vector3(radius * d.x(), radius * d.y(), height * d.squaredNorm());
  };
  const Sheet inside = [&](const Eigen::Vector2d& d) {
    const double slope = 2 * height / radius;
    const Vector3 normal = Vector3(-slope * d.x(), -slope * d.y(), 1).normalized();
    return Vector3(outside(d) + (request["thickness"] - request["depth"] * relief(d)) * normal);
  };
  return centred(wallMesh(request.whole("cells"), inside, outside));
}

TriangleMesh helixBowlMesh(const Request& request) {
  const double turns = request["turns"];
  return bowlMesh(request, [turns](const Eigen::Vector2d& d) {
    const double fromMiddle = d.norm();
    const double phase = 2 * kPi * turns * fromMiddle - std::atan2(d.y(), d.x());
    // The groove fades out in the middle of the bowl, where the direction of the spiral is undefined.
    const double fade = std::clamp(2 * turns * fromMiddle - 1, 0.0, 1.0);
    return fade * fade * (3 - 2 * fade) * (0.5 + 0.5 * std::cos(phase));
  });
}

TriangleMesh structuredBowlMesh(const Request& request) {
  const double step = kPi * request["bumps"];
  return bowlMesh(request, [step](const Eigen::Vector2d& d) {
    const auto waves = [&](double times) { return std::cos(times * step * d.x()) * std::cos(times * step * d.y()); };
    return 0.5 - 0.35 * waves(1) - 0.15 * waves(3);
  });
}

TriangleMesh marbleRunMesh(const Request& request) {
  const double outer = request["width"] / 2, inner = outer - request["thickness"];
  const std::uint32_t sides = request.whole("sides"), loop = 2 * (sides + 1);
  const std::uint32_t steps = request.whole("turns") * request.whole("steps");
  // Make the points (distance outwards, height) of the channel's cross-section. The points run along the outside of
  // the channel from lip to lip, and back along its inside.
  std::vector<Eigen::Vector2d> section;
  for (std::uint32_t i = 0; i <= sides; ++i) section.push_back(outer * onCircle(sides + i, 2.0 * sides));
  for (std::uint32_t i = 0; i <= sides; ++i) section.push_back(inner * onCircle(2.0 * sides - i, 2.0 * sides));
  TriangleMesh mesh;
  for (std::uint32_t step = 0; step <= steps; ++step) {
    const Eigen::Vector2d direction = onCircle(-double(step), request["steps"]);
    const double z = -request["height"] * step / steps;
    for (const Eigen::Vector2d& s : section) {
      const double fromAxis = request["radius"] - outer + s.x();
      mesh.vertices.emplace_back(fromAxis * direction.x(), fromAxis * direction.y(), z + s.y());
    }
  }
  for (std::uint32_t step = 0; step < steps; ++step)
    for (std::uint32_t i = 0; i < loop; ++i) {
      const std::uint32_t a = step * loop + i, b = step * loop + (i + 1) % loop;
      addQuad(mesh, a, b, b + loop, a + loop);
    }
  for (std::uint32_t i = 0; i < sides; ++i) {  // Close the two ends of the channel.
    const std::uint32_t last = steps * loop, back = loop - 1 - i;
    addQuad(mesh, i, back, back - 1, i + 1);
    addQuad(mesh, last + i, last + i + 1, last + back - 1, last + back);
  }
  return centred(std::move(mesh));
}

}  // namespace

std::span<const Shape> catalogue() { return shapeList(); }

TriangleMesh mesh(std::string_view spec) {
  using Maker = TriangleMesh (*)(const Request&);
  static const std::map<std::string, Maker, std::less<>> makers = {{"sphere", sphereMesh},
                                                                   {"torus", torusMesh},
                                                                   {"box", boxMesh},
                                                                   {"gear", gearMesh},
                                                                   {"helix-bowl", helixBowlMesh},
                                                                   {"marble-run", marbleRunMesh},
                                                                   {"structured-bowl", structuredBowlMesh}};
  const Request request = parse(spec, "builtin:");
  TriangleMesh result = makers.at(request.shape->name)(request);
  result.name = "builtin:" + request.text;
  return result;
}

DistanceFunction analytic(std::string_view spec) {
  const Request request = parse(spec, "analytic:");
  Source source{.name = "analytic:" + request.text, .box = {}};
  const auto setBox = [&](const Vector3& half) { source.box = Box(-half, half); };
  if (request.shape->name == "sphere") {
    const double radius = request["radius"];
    setBox(Vector3::Constant(radius));
    return {[radius](const Vector3& x) { return sphereDistance(x, radius); }, source};
  }
  if (request.shape->name == "torus") {
    const double major = request["major"];
    const double minor = request["minor"];
    setBox({major + minor, major + minor, minor});
    return {[major, minor](const Vector3& x) { return torusDistance(x, major, minor); }, source};
  }
  if (request.shape->name == "box") {
    const Vector3 half = boxHalfSize(request);
    setBox(half);
    return {[half](const Vector3& x) { return boxDistance(x, half); }, source};
  }
  request.fail("no distance in closed form is known; use builtin:" + request.text);
}

double sphereDistance(const Vector3& x, double radius) { return x.norm() - radius; }

double torusDistance(const Vector3& x, double majorRadius, double minorRadius) {
  const double fromRing = std::sqrt(x.x() * x.x() + x.y() * x.y()) - majorRadius;
  return std::sqrt(fromRing * fromRing + x.z() * x.z()) - minorRadius;
}

double boxDistance(const Vector3& x, const Vector3& halfSize) {
  const Vector3 beyond = x.cwiseAbs() - halfSize;
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

}  // namespace hpsdf::shapes
