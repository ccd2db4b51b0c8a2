// Tests `hpsdf why`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"

namespace hpsdf::app {
namespace why_test {

using namespace cli;
using cli::Call;
using cli::Json;
using Why = Cli;

TEST_F(Why, tellsHowTheConstructionArrivedAtACell) {
  const Outcome outcome = run({{"why", field(), "0.7,0.1,0.05", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const Field loaded = load(field());
  const Cell cell = loaded.cellAt({0.7, 0.1, 0.05});
  EXPECT_EQ(json.at("cell"), cell.id);
  EXPECT_EQ(json.at("depth"), cell.depth);
  EXPECT_EQ(json.at("degree"), cell.degree);
  EXPECT_EQ(json.at("agrees"), 1);
  EXPECT_EQ(json.at("sign").at("inside"), true);
  EXPECT_NEAR(json.at("sign").at("winding_number").get<double>(), 1, 1e-9);
  EXPECT_EQ(json.at("steps").size(), json.at("raised").get<std::size_t>() + json.at("divided").get<std::size_t>() + 1);
  EXPECT_EQ(json.at("steps").back().at("choice"), "kept");
  EXPECT_EQ(json.at("steps").back().at("degree"), cell.degree);
  EXPECT_GE(json.at("measured_max").get<double>(), std::abs(json.at("error").get<double>()) / 4);

  const Outcome text = run({{"why", field(), "0.7,0.1,0.05"}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("of triangle"), HasSubstr("inside"), HasSubstr("gain of degree"),
                              HasSubstr("had fallen below")));
  expectRefused({{"why", field(), "9,0,0"}}, "lies outside the field's domain", {});
}

TEST_F(Why, findsTheMeshBesideTheField) {
  writeFile(at("solid.obj"), kTetrahedron);
  ASSERT_EQ(run({{"build", at("solid.obj"), "-o", at("solid.hpsdf"), "--tolerance", "1%"}}).status, 0);
  const Outcome outcome = run({{"why", at("solid.hpsdf"), "0.2,0.2,0.1"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("error / allowed"), HasSubstr("Only 4 triangles can be nearest")));
  EXPECT_EQ(run({{"verify", at("solid.hpsdf"), "--points", "1000"}}).status, 0) << "verify finds it too";

  writeFile(at("solid.obj"), std::string(kTetrahedron) + "v 2 2 2\nf 1 2 5\n");
  expectRefused({{"why", at("solid.hpsdf"), "0.2,0.2,0.1"}}, "the contents of these files were others",
                {"solid.hpsdf", "solid.obj"});
  fs::remove(at("solid.obj"));
  expectRefused({{"why", at("solid.hpsdf"), "0.2,0.2,0.1"}}, "needs the mesh that it was made from", {"solid.hpsdf"});
}

}  // namespace why_test
}  // namespace hpsdf::app
