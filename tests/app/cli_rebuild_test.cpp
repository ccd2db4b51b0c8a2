// Tests `hpsdf rebuild`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {
namespace cli_rebuild_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)

class Rebuild : public Cli {
 protected:
  /// Writes a torus, in other units. Its corner with the greatest y is moved outwards by `by`, and the one nearest to
  /// the middle is moved towards that by the share `inside`.
  std::string torus(const std::string& name, double by, double scale = 1, double inside = 0) const {
    TriangleMesh mesh = shapes::mesh("torus");
    auto nearest = std::ranges::min_element(mesh.vertices, {}, [](const Vector3& v) { return v.norm(); });
    *nearest *= 1 - inside;
    auto farthest = std::ranges::max_element(mesh.vertices, {}, [](const Vector3& v) { return v.y(); });
    farthest->y() += by;
    std::ostringstream text;
    text.precision(17);
    for (const Vector3& v : mesh.vertices) text << "v " << (scale * v).transpose() << "\n";
    for (const auto& [a, b, c] : mesh.triangles) text << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
    writeFile(at(name), text.str());
    return at(name);
  }
};

TEST_F(Rebuild, keepsAndReports) {
  const std::string before = torus("before.obj", 0), after = torus("after.obj", 0.02);
  ASSERT_EQ(run({{"build", before, "-o", at("f.hpsdf"), "--target-error", "1e-6"}}).status, 0);
  const Outcome outcome = run({{"rebuild", at("f.hpsdf"), before, after, "-o", at("g.hpsdf"), "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_GT(json.at("kept_leaves"), 0);
  EXPECT_LT(json.at("kept_leaves"), json.at("leaves_before"));
  EXPECT_LT(json.at("distances"), json.at("distances_before"));
  EXPECT_EQ(json.at("changed_triangles"), 12);  // six around a corner, before and after
  EXPECT_EQ(json.at("signs_change"), false);
  EXPECT_GT(json.at("measured").at("near").at("rms"), 0);
  EXPECT_EQ(load(at("g.hpsdf")).metadata().source.name, "after.obj");
  const Outcome text = run({{"rebuild", at("f.hpsdf"), before, after, "-o", at("h.hpsdf"), "--threads", "1"}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("kept: "), HasSubstr("distances: "), HasSubstr("measured: ")));
  EXPECT_EQ(readFile(at("g.hpsdf")), readFile(at("h.hpsdf")));
}

/// The box of a normalized field's mesh must stay, because it says how the mesh is transformed.
TEST_F(Rebuild, normalizedFields) {
  const std::string before = torus("before.obj", 0, 30), after = torus("after.obj", 0, 30, 0.01);
  const std::string wider = torus("wider.obj", 0.01, 30);
  ASSERT_EQ(run({{"build", before, "-o", at("f.hpsdf"), "--target-error", "1e-6", "--normalize"}}).status, 0);
  const Outcome outcome = run({{"rebuild", at("f.hpsdf"), before, after, "-o", at("g.hpsdf"), "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out).at("changed_triangles"), 12);
  EXPECT_EQ(run({{"verify", at("g.hpsdf"), after, "--max-mismatches", "0", "--points", "1000"}}).err, "");
  expectRefused({{"rebuild", at("f.hpsdf"), before, wider, "-o", at("h.hpsdf")}},
                "wider.obj: has another box than the mesh of the field, which is normalized");
}

TEST_F(Rebuild, mistakesAreRefused) {
  const std::string before = torus("before.obj", 0), other = torus("other.obj", 0.3), far = torus("far.obj", 9);
  ASSERT_EQ(run({{"build", before, "-o", at("f.hpsdf"), "--target-error", "1e-4"}}).status, 0);
  const auto call = [&](const std::string& first, const std::string& second) {
    return Call{{"rebuild", at("f.hpsdf"), first, second, "-o", at("g.hpsdf")}};
  };
  expectRefused(call(other, before), "other.obj: is not the mesh of the field, which was built from before.obj");
  expectRefused(call(before, far), "far.obj: leaves the domain of the field");
  expectRefused(call(before, at("none.obj")), "none.obj");
  expectRefused(call(before, "analytic:torus"), "analytic:torus");
  expectRefused({{"rebuild", at("f.hpsdf"), before, "-o", at("g.hpsdf")}}, "after");
}

}  // namespace cli_rebuild_test
}  // namespace hpsdf::app
