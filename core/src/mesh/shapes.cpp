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
#include "hpsdf/error.h"

namespace hpsdf::shapes {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kShortest = 1e-3;  // lengths: far enough apart for all parts of a shape to stay exact in double
constexpr double kLongest = 1e3;

Parameter length(std::string name, double defaultValue, std::string help) {
  return {std::move(name), defaultValue, kShortest, kLongest, false, std::move(help)};
}

Parameter count(std::string name, double defaultValue, double minimum, double maximum, std::string help) {
  return {std::move(name), defaultValue, minimum, maximum, true, std::move(help)};
}

const std::vector<Shape>& shapeList() {
  // The upper limits of the counts keep every mesh below some 8 million faces.
  static const std::vector<Shape> list = {
      {"sphere",
       "an icosahedron subdivided towards a sphere",
       {length("radius", 1, "radius"), count("subdivisions", 6, 0, 9, "each makes four faces of one, from 20")},
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
        length("tooth-depth", 0.22, "from the tips down to the roots"), length("hole", 0.3, "radius of the bore"),
        length("thickness", 0.5, "full size along z"),
        count("segments", 8, 1, 64, "steps along each tip and each root; even ones put a corner mid-tip")},
       false},
      {"helix-bowl",
       "a bowl, open towards +z, with a groove that runs down in a spiral; 329k faces with cells=143",
       {length("radius", 1, "of the rim, outside"), length("height", 0.8, "of the bowl's outside"),
        length("thickness", 0.1, "of the wall beside the groove"),
        length("depth", 0.06, "of the groove, below thickness"),
        count("turns", 4, 1, 64, "of the groove around the axis"),
        count("cells", 48, 8, 700, "of the mesh from the middle to the rim")},
       false},
      {"marble-run",
       "a channel, open towards +z, that winds down around the axis z; 53k faces with steps=255,sides=12",
       {length("radius", 1, "outer radius of the turns"), length("height", 1, "that it descends"),
        length("width", 0.16, "of the channel, outside"),
        length("thickness", 0.02, "of its wall, below half of the width"), count("turns", 4, 1, 64, "around the axis"),
        count("steps", 96, 8, 1024, "a turn"), count("sides", 8, 2, 64, "steps around the channel's half circle")},
       false},
      {"structured-bowl",
       "a bowl, open towards +z, with fine bumps all over its inside; 4.1M faces with cells=506,bumps=40",
       {length("radius", 1, "of the rim, outside"), length("height", 0.8, "of the bowl's outside"),
        length("thickness", 0.1, "of the wall under the highest bumps"),
        length("depth", 0.03, "from their tops to their valleys, below thickness"),
        count("bumps", 8, 1, 200, "across the bowl, each with smaller ones on it"),
        count("cells", 48, 8, 700, "of the mesh from the middle to the rim")},
       false},
  };
  return list;
}

// ---------------------------------------------------------------------------------------------------------------------
// Specs

template <typename List>
std::vector<std::string> namesOf(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return names;
}

/// "; did you mean NAME?" where a known name is near, else "; known: all of them".
std::string suggestion(std::string_view wanted, const std::vector<std::string>& known) {
  if (const std::string near = nearestName(wanted, known); !near.empty()) return "; did you mean " + near + "?";
  std::string all;
  for (const std::string& name : known) all += (all.empty() ? "" : ", ") + name;
  return "; known: " + all;
}

std::string format(double x) {
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), x);
  return {text.data(), end};
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// A spec taken apart: the shape, and the value of every parameter.
struct Request {
  const Shape* shape;
  std::string text;  ///< without prefix
  std::map<std::string, double, std::less<>> values;

  double operator[](std::string_view name) const { return values.find(name)->second; }
  unsigned whole(std::string_view name) const { return static_cast<unsigned>((*this)[name]); }
};

[[noreturn]] void fail(std::string_view spec, const std::string& problem) {
  throw Error("shape '" + std::string(spec) + "': " + problem);
}

double parseValue(const Parameter& parameter, std::string_view text, std::string_view spec) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
      (parameter.whole && value != std::floor(value)))
    fail(spec, parameter.name + "='" + std::string(text) + "' is not a " + (parameter.whole ? "whole " : "") +
                   "number; give one like " + parameter.name + "=" + format(parameter.defaultValue));
  if (value < parameter.minimum || value > parameter.maximum)
    fail(spec, parameter.name + "=" + std::string(text) + " is out of range; give " + format(parameter.minimum) +
                   " to " + format(parameter.maximum));
  return value;
}

void assign(Request& request, std::string_view item, std::vector<std::string>& seen, std::string_view spec) {
  const std::size_t equals = item.find('=');
  const std::string_view name = trimmed(item.substr(0, equals));
  const std::vector<Parameter>& known = request.shape->parameters;
  const auto parameter = std::find_if(known.begin(), known.end(), [&](const Parameter& p) { return p.name == name; });
  if (parameter == known.end())
    fail(spec,
         request.shape->name + " has no parameter '" + std::string(name) + "'" + suggestion(name, namesOf(known)));
  if (equals == std::string_view::npos)
    fail(spec, parameter->name + " has no value; write " + parameter->name + "=" + format(parameter->defaultValue));
  if (std::find(seen.begin(), seen.end(), name) != seen.end())
    fail(spec, parameter->name + " is given twice; give it once");
  seen.emplace_back(name);
  request.values.find(name)->second = parseValue(*parameter, trimmed(item.substr(equals + 1)), spec);
}

/// Relations between parameters that no single range can express.
void requireSoundProportions(const Request& request, std::string_view spec);

Request parse(std::string_view spec, std::string_view prefix) {
  std::string_view rest = trimmed(spec);
  if (rest.starts_with(prefix)) rest.remove_prefix(prefix.size());
  Request request{nullptr, std::string(rest), {}};

  std::size_t comma = rest.find(',');
  const std::string_view name = trimmed(rest.substr(0, comma));
  const std::vector<Shape>& list = shapeList();
  const auto shape = std::find_if(list.begin(), list.end(), [&](const Shape& s) { return s.name == name; });
  if (shape == list.end())
    fail(spec, "there is no shape '" + std::string(name) + "'" + suggestion(name, namesOf(list)));
  request.shape = &*shape;
  for (const Parameter& parameter : shape->parameters) request.values[parameter.name] = parameter.defaultValue;

  std::vector<std::string> seen;
  while (comma != std::string_view::npos) {
    rest.remove_prefix(comma + 1);
    comma = rest.find(',');
    assign(request, rest.substr(0, comma), seen, spec);
  }
  requireSoundProportions(request, spec);
  return request;
}

// ---------------------------------------------------------------------------------------------------------------------
// Meshes

/// Point `i` of `n` on the unit circle; exact on the axes, so that boxes and symmetry planes are.
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
  const double phi = std::numbers::phi;  // in this position its edges' midpoints lie on the axes
  TriangleMesh mesh;
  mesh.vertices = {{-1, phi, 0},  {1, phi, 0},  {-1, -phi, 0}, {1, -phi, 0}, {0, -1, phi},  {0, 1, phi},
                   {0, -1, -phi}, {0, 1, -phi}, {phi, 0, -1},  {phi, 0, 1},  {-phi, 0, -1}, {-phi, 0, 1}};
  // Three corners at mutual distance 2, the edge length, are a face.
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

/// Every face in four, new vertices at the arcs' middles on the unit sphere.
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

// Sphere and torus are meshed so that mesh and smooth shape have the same volume. With the vertices on the surface
// every face would lie inside it, a bias that grows to a whole sagitta; this way the deviations cancel on average and
// their RMS is a third as large.

TriangleMesh sphereMesh(const Request& request) {
  TriangleMesh mesh = icosahedron();
  for (unsigned i = 0; i < request.whole("subdivisions"); ++i) subdivide(mesh);
  const double scale = request["radius"] * std::cbrt(4 * kPi / 3 / signedVolume(mesh));
  for (Vector3& v : mesh.vertices) v *= scale;
  return mesh;
}

/// Factor that gives a regular polygon of n corners the area of its circle.
double equalAreaFactor(double n) { return std::sqrt((2 * kPi / n) / std::sin(2 * kPi / n)); }

TriangleMesh torusMesh(const Request& request) {
  const std::uint32_t segments = request.whole("segments");
  const std::uint32_t sides = request.whole("sides");
  // By Pappus the tube's polygon must have its circle's area; and slices across the axis are polygons themselves.
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
  for (unsigned corner = 0; corner < 8; ++corner)  // bits: x, y, z
    mesh.vertices.emplace_back(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                               corner & 4 ? half.z() : -half.z());
  addQuad(mesh, 0, 4, 6, 2);  // -x
  addQuad(mesh, 1, 3, 7, 5);  // +x
  addQuad(mesh, 0, 1, 5, 4);  // -y
  addQuad(mesh, 2, 6, 7, 3);  // +y
  addQuad(mesh, 0, 2, 3, 1);  // -z
  addQuad(mesh, 4, 5, 7, 6);  // +z
  return mesh;
}

/// A corner of the gear's outline: its place on the circle in turns of the whole pitch, and its distance from the axis.
struct OutlinePoint {
  double turn;
  double radius;
};

/// The outline anticlockwise. Of a tooth's pitch the tip takes 0.26, each straight flank 0.13, the root the rest.
/// The turn grows from point to point, so that outline and bore pair up corner by corner.
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
  for (std::uint32_t a = 0; a < corners; a += 4) {  // at each turn: outline below, above, bore below, above
    const std::uint32_t b = (a + 4) % corners;
    addQuad(mesh, a, b, b + 1, a + 1);          // outline
    addQuad(mesh, a + 1, b + 1, b + 3, a + 3);  // top
    addQuad(mesh, a + 3, b + 3, b + 2, a + 2);  // bore
    addQuad(mesh, a + 2, b + 2, b, a);          // bottom
  }
  return mesh;
}

/// Moved so that its box is about the origin.
TriangleMesh centred(TriangleMesh mesh) {
  const Vector3 center = boundingBox(mesh).center();
  for (Vector3& v : mesh.vertices) v -= center;
  return mesh;
}

/// A point of the unit disc for one of the square [-1, 1]²: cells of a grid keep about the same size, and there is no
/// pole where they shrink.
Eigen::Vector2d onDisc(double x, double y) { return {x * std::sqrt(1 - y * y / 2), y * std::sqrt(1 - x * x / 2)}; }

/// A wall between two sheets over the unit disc, `inside` above `outside`, joined along their rims.
template <typename Sheet>
TriangleMesh wallMesh(std::uint32_t cells, const Sheet& inside, const Sheet& outside) {
  const std::uint32_t n = 2 * cells, row = n + 1, sheet = row * row;
  TriangleMesh mesh;
  mesh.vertices.reserve(std::size_t{2} * sheet);
  mesh.triangles.reserve(std::size_t{4} * n * n + std::size_t{8} * n);
  for (const Sheet& place : {inside, outside})
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i)
        mesh.vertices.push_back(place(onDisc((double(i) - cells) / cells, (double(j) - cells) / cells)));
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::array<std::uint32_t, 4> at = {j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i};
      // diagonals towards the square's corners, where two sides of a cell lie on the rim
      const std::uint32_t first = (i < cells) == (j < cells) ? 0 : 1;
      const auto corner = [&](std::uint32_t k) { return at[(first + k) % 4]; };
      addQuad(mesh, corner(0), corner(1), corner(2), corner(3));
      addQuad(mesh, sheet + corner(0), sheet + corner(3), sheet + corner(2), sheet + corner(1));
    }
  const auto rim = [&](std::uint32_t k) {  // anticlockwise from the corner (-1, -1)
    const std::uint32_t along = k % n;
    switch (k / n % 4) {
      case 0:
        return along;
      case 1:
        return along * row + n;
      case 2:
        return n * row + n - along;
      default:
        return (n - along) * row;
    }
  };
  for (std::uint32_t k = 0; k < 4 * n; ++k) addQuad(mesh, rim(k + 1), rim(k), sheet + rim(k), sheet + rim(k + 1));
  return mesh;
}

/// A paraboloid's wall, its inside lowered by relief(point of the unit disc), from 0 to 1 of the depth.
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
    const double begun = std::clamp(2 * turns * fromMiddle - 1, 0.0, 1.0);  // a spiral has no end in the middle
    return begun * begun * (3 - 2 * begun) * (0.5 + 0.5 * std::cos(phase));
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
  std::vector<Eigen::Vector2d> section;  // away from the axis, and up: outside from lip to lip, and back inside
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
  for (std::uint32_t i = 0; i < sides; ++i) {  // the two ends
    const std::uint32_t last = steps * loop, back = loop - 1 - i;
    addQuad(mesh, i, back, back - 1, i + 1);
    addQuad(mesh, last + i, last + i + 1, last + back - 1, last + back);
  }
  return centred(std::move(mesh));
}

void requireSoundBowl(const Request& request, std::string_view spec) {
  if (request["depth"] >= request["thickness"])
    fail(spec, "the relief cuts through the wall; make depth smaller than thickness");
  // the radius of curvature in the middle, where it is least
  if (request["thickness"] >= request["radius"] * request["radius"] / (2 * request["height"]))
    fail(spec, "the wall is thicker than the bowl is wide at its bottom; make thickness or height smaller");
}

void requireSoundRun(const Request& request, std::string_view spec) {
  if (request["thickness"] >= request["width"] / 2)
    fail(spec, "the wall fills the channel; make thickness smaller than half of the width");
  if (request["width"] >= request["radius"]) fail(spec, "the channel meets the axis; make width smaller than radius");
  if (request["turns"] > 1 && request["height"] / request["turns"] <= request["width"] / 2)
    fail(spec, "the turns meet; make height larger, or turns or width smaller");
}

void requireSoundProportions(const Request& request, std::string_view spec) {
  if (request.shape->name.ends_with("-bowl")) requireSoundBowl(request, spec);
  if (request.shape->name == "marble-run") requireSoundRun(request, spec);
  if (request.shape->name == "torus") {
    if (request["minor"] >= request["major"]) fail(spec, "the tube meets the axis; make minor smaller than major");
    if (request["minor"] * equalAreaFactor(request["sides"]) >= request["major"])
      fail(spec, "a tube with so few sides meets the axis; make minor smaller or sides larger");
  }
  if (request.shape->name == "gear") {
    if (request["tooth-depth"] >= request["radius"])
      fail(spec, "the teeth reach the axis; make tooth-depth smaller than radius");
    if (request["hole"] >= request["radius"] - request["tooth-depth"])
      fail(spec, "the bore cuts the roots of the teeth; make hole smaller than radius - tooth-depth");
  }
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
  fail(spec, "no distance in closed form is known; use builtin:" + request.text);
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
