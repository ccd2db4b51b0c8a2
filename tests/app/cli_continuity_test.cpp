// Tests `hpsdf smooth`, `blend`, `bounds` and `study continuity`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"

namespace hpsdf::app {
namespace cli_continuity_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Continuity = Cli;

/// Returns true if two field files are equal when the measured errors are removed from both. Commands that change a
/// field do not measure it again.
bool areEqualBesidesMeasurement(const std::string& first, const std::string& second) {
  for (const std::string& file : {first, second}) {
    FieldData data = load(file).data();
    data.metadata.measurement.reset();
    save(Field(std::move(data)), file + ".unmeasured");
  }
  return readFile(first + ".unmeasured") == readFile(second + ".unmeasured");
}

TEST_F(Continuity, smoothEqualsBuildWithWeakContinuity) {
  const std::vector<std::string> build = {"build", "builtin:torus",  "--target-error",
                                          "1e-4",  "--coefficients", "double"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run({with(build, {"-o", at("plain.hpsdf")})}).status, 0);
  ASSERT_EQ(run({with(build, {"-o", at("weak.hpsdf"), "--continuity", "weak", "--continuity-weight", "0.7"})}).status,
            0);
  const Outcome smoothed =
      run({{"smooth", at("plain.hpsdf"), "-o", at("smooth.hpsdf"), "--continuity-weight", "0.7", "--json"}});
  ASSERT_EQ(smoothed.status, 0) << smoothed.err;
  EXPECT_TRUE(areEqualBesidesMeasurement(at("smooth.hpsdf"), at("weak.hpsdf")));
  const Json json = Json::parse(smoothed.out);
  EXPECT_EQ(json.at("continuity_weight"), 0.7);
  EXPECT_GT(json.at("change"), 0);
  EXPECT_GT(json.at("iterations"), 1);
  EXPECT_LT(findJumps(load(at("smooth.hpsdf"))).value.rms, 0.5 * findJumps(load(at("plain.hpsdf"))).value.rms);
  EXPECT_THAT(run({{"info", at("smooth.hpsdf")}}).out, HasSubstr("continuity-weight 0.7"));
  EXPECT_TRUE(Json::parse(run({{"info", at("plain.hpsdf"), "--json"}}).out).at("continuity_weight").is_null());
  expectRefused({{"smooth", at("smooth.hpsdf"), "-o", at("twice.hpsdf")}},
                "smooth.hpsdf: is weakly continuous already");
  expectRefused({{"smooth", at("plain.hpsdf"), "-o", at("plain.hpsdf")}}, "plain.hpsdf");
}

TEST_F(Continuity, blendEqualsBuildWithExactContinuity) {
  const std::vector<std::string> build = {"build", "builtin:torus", "--target-error", "1e-3"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run({with(build, {"-o", at("plain.hpsdf")})}).status, 0);
  ASSERT_EQ(run({with(build, {"-o", at("exact.hpsdf"), "--continuity", "exact", "--blend-width", "0.1"})}).status, 0);
  const Outcome blended = run({{"blend", at("plain.hpsdf"), "-o", at("blended.hpsdf"), "--width", "0.1", "--json"}});
  ASSERT_EQ(blended.status, 0) << blended.err;
  EXPECT_TRUE(areEqualBesidesMeasurement(at("blended.hpsdf"), at("exact.hpsdf")));
  EXPECT_EQ(Json::parse(blended.out).at("output"), at("blended.hpsdf"));
  EXPECT_EQ(load(at("blended.hpsdf")).data().blend, 0.1);
  const auto jump = [&](const char* name) {
    return Json::parse(run({{"jumps", at(name), "--json"}}).out).at("value").at("max").get<double>();
  };
  EXPECT_GT(jump("plain.hpsdf"), 1e-3);
  EXPECT_LT(jump("blended.hpsdf"), 1e-14);
  EXPECT_THAT(run({{"info", at("blended.hpsdf")}}).out, HasSubstr("exact: blended within 0.1 of an edge from faces"));
  // Weak continuity and blending can be combined, in two commands or in one.
  ASSERT_EQ(run({{"smooth", at("plain.hpsdf"), "-o", at("smooth.hpsdf")}}).status, 0);
  const Outcome text = run({{"blend", at("smooth.hpsdf"), "-o", at("both.hpsdf")}});
  ASSERT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(StartsWith(at("both.hpsdf") + ": "), HasSubstr("blended within 0.04 of an edge")));
  const FieldMetadata both = load(at("both.hpsdf")).metadata();
  EXPECT_EQ(both.settings.continuityWeight, 2.5);
  ASSERT_EQ(run({with(build, {"-o", at("once.hpsdf"), "--continuity", "both"})}).status, 0);
  EXPECT_EQ(load(at("once.hpsdf")).metadata().settings.continuityWeight, 2.5);
  EXPECT_LT(jump("once.hpsdf"), 1e-14);
  expectRefused({{"blend", at("plain.hpsdf"), "-o", at("plain.hpsdf")}}, "plain.hpsdf: is read by the same command");
  expectRefused({{"blend", at("none.hpsdf"), "-o", at("x.hpsdf")}}, "none.hpsdf: no such file");
  expectRefused({{"blend", at("plain.hpsdf"), "-o", at("none/x.hpsdf")}}, "none/x.hpsdf");
}

TEST_F(Continuity, boundsAreStoredReportedAndHold) {
  const std::vector<std::string> build = {"build", "builtin:torus", "--target-error", "1e-3", "-o"};
  std::vector<std::string> bounded = build, plain = build;
  bounded.insert(bounded.end(), {at("bounds.hpsdf"), "--bounds"});
  plain.push_back(at("plain.hpsdf"));
  ASSERT_EQ(run({bounded}).status, 0);
  ASSERT_EQ(run({plain}).status, 0);
  EXPECT_GT(fs::file_size(at("bounds.hpsdf")), fs::file_size(at("plain.hpsdf")));
  EXPECT_THAT(run({{"info", at("bounds.hpsdf")}}).out, HasSubstr("bounds of the error"));
  EXPECT_THAT(run({{"info", at("plain.hpsdf")}}).out, Not(HasSubstr("bounds of the error")));
  const Outcome verified =
      run({{"verify", at("bounds.hpsdf"), "--points", "20000", "--max-violations", "0", "--worst", "0"}});
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("no point is beyond its bound"));
  expectRefused({{"verify", at("plain.hpsdf"), "--max-violations", "0", "--script", at("worst.hps")}},
                "max-violations: " + at("plain.hpsdf") + " keeps no bounds");
  // Blending changes the errors, so that it removes the stored error bounds.
  ASSERT_EQ(run({{"blend", at("bounds.hpsdf"), "-o", at("blended.hpsdf")}}).status, 0);
  EXPECT_TRUE(load(at("blended.hpsdf")).data().bounds.empty());
  // Bounds of an open mesh's field cause a warning.
  writeFile(at("open.off"), "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  const Outcome open =
      run({{"build", at("open.off"), "--bounds", "-o", at("open.hpsdf"), "--target-error", "1e-1", "--grid", "2"}});
  EXPECT_EQ(open.status, 0);
  EXPECT_THAT(open.err, HasSubstr("warning: bounds hold for closed surfaces alone"));
}

TEST_F(Continuity, boundsOfAnExistingFieldEqualThoseOfBuild) {
  const auto build = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"build", "builtin:torus", "--target-error", "1e-4", "-o", at(name)};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  };
  build("plain.hpsdf", {});
  build("bounded.hpsdf", {"--bounds"});
  const Outcome found = run({{"bounds", at("plain.hpsdf"), "builtin:torus", "-o", at("found.hpsdf"), "--json"}});
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_TRUE(areEqualBesidesMeasurement(at("found.hpsdf"), at("bounded.hpsdf")));
  const Json json = Json::parse(found.out);
  EXPECT_GT(json.at("bounds").at("median"), 0);
  EXPECT_EQ(json.at("output"), at("found.hpsdf"));
  build("exact.hpsdf", {"--continuity", "exact", "--bounds"});
  ASSERT_EQ(run({{"blend", at("plain.hpsdf"), "-o", at("blended.hpsdf")}}).status, 0);
  ASSERT_EQ(run({{"bounds", at("blended.hpsdf"), "-o", at("certain.hpsdf")}}).status, 0) << "a shape's name is known";
  EXPECT_TRUE(areEqualBesidesMeasurement(at("certain.hpsdf"), at("exact.hpsdf")));
  // Bounds that the field already has are computed again, with the same result.
  const Outcome again = run({{"bounds", at("found.hpsdf"), "-o", at("again.hpsdf"), "--threads", "1"}});
  EXPECT_THAT(again.out, AllOf(HasSubstr("again.hpsdf: nowhere wrong by more than"), HasSubstr("in the median cell")));
  const auto errorsOf = [&](const std::string& name) {
    std::vector<float> errors;
    const Field field = load(at(name));
    for (const CellBound& bound : field.data().bounds) errors.push_back(bound.error);
    return errors;
  };
  EXPECT_EQ(errorsOf("again.hpsdf"), errorsOf("bounded.hpsdf"));
}

TEST_F(Continuity, boundsRequireTheFieldsOwnMesh) {
  writeFile(at("t.obj"), kTetrahedron);
  writeFile(at("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto build = [&](const std::string& mesh, const std::string& name) {
    const Outcome outcome = run(
        {{"build", at(mesh), "-o", at(name), "--target-error", "1e-1", "--grid", "2", "--domain", "-1,-1,-1,2,2,2"}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  };
  build("t.obj", "t.hpsdf");
  build("open.obj", "open.hpsdf");
  fs::create_directory(at("alone"));
  fs::copy(at("t.hpsdf"), at("alone"));
  expectRefused({{"bounds", at("alone/t.hpsdf"), "-o", at("b.hpsdf")}}, "give MESH, t.obj");
  expectRefused({{"bounds", at("t.hpsdf"), "builtin:gear", "-o", at("b.hpsdf")}},
                "was made from t.obj, not from builtin:gear; give that mesh");
  expectRefused({{"bounds", at("t.hpsdf"), at("none.obj"), "-o", at("b.hpsdf")}}, "none.obj");
  expectRefused({{"bounds", at("t.hpsdf"), at("t.obj"), "-o", at("t.obj")}}, "t.obj: is read by the same command");
  expectRefused({{"bounds", at("t.hpsdf"), at("t.obj")}}, "--output is missing");
  EXPECT_THAT(run({{"bounds", at("t.hpsdf"), at("t.obj"), "-o", at("b.hpsdf")}}).err, IsEmpty());
  const Outcome open = run({{"bounds", at("open.hpsdf"), at("open.obj"), "-o", at("b.hpsdf")}});
  EXPECT_EQ(open.status, 0) << open.err;
  EXPECT_THAT(open.err, HasSubstr("bounds hold for closed surfaces alone"));
}

TEST_F(Continuity, continuityIsStudied) {
  const Outcome outcome =
      run({{"study", "continuity", "builtin:torus", "analytic:sphere", "--target-error", "1e-5", "--estimator",
            "embedded", "--points", "20000", "--weights", "10,2.5,0.4", "-o", at("study"), "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json rows = Json::parse(outcome.out);
  ASSERT_EQ(rows.size(), 16u) << "two meshes, with and without enrichment, three weights and none";
  const auto figure = [&](std::size_t row, const char* name) { return rows[row].at(name).get<double>(); };
  for (std::size_t first = 0; first < 16; first += 4)
    for (std::size_t row = first + 1; row < first + 4; ++row) {  // each row has a smaller weight than the previous row
      EXPECT_LT(figure(row, "jump_rms"), figure(row - 1, "jump_rms")) << row;
      EXPECT_GT(figure(row, "rms"), figure(row - 1, "rms")) << row;
      EXPECT_LT(figure(row, "bytes"), 1.3 * figure(first, "bytes")) << row;
    }
  EXPECT_TRUE(rows[0].at("weight").is_null());
  EXPECT_EQ(figure(0, "jump_rms_ratio"), 1);
  EXPECT_FALSE(rows[2].at("enriched"));
  EXPECT_EQ(figure(2, "weight"), 2.5);
  EXPECT_LT(figure(2, "jump_rms_ratio"), 0.5);
  EXPECT_LT(figure(2, "rms_ratio"), 1.5);
  EXPECT_TRUE(rows[7].at("enriched"));
  EXPECT_EQ(figure(7, "weight"), 0.4);
  EXPECT_LT(figure(7, "jump_rms_ratio"), 0.12);
  EXPECT_LT(figure(7, "rms_ratio"), 1.02);
  EXPECT_LT(figure(7, "bytes_ratio"), 2.1);
  const std::string table = readFile(at("study/continuity.csv"));
  EXPECT_EQ(lineCount(table), 17u);
  EXPECT_THAT(table, StartsWith("mesh,enriched,weight,jump_rms,"));
  EXPECT_THAT(table, HasSubstr("\"analytic:sphere\",1,0.4,"));
  EXPECT_EQ(Json::parse(readFile(at("study/continuity.json"))), rows);
  const Outcome text =
      run({{"study", "continuity", "analytic:sphere", "--points", "1000", "--weights", "1", "-o", at("text")}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("enriched"), HasSubstr("RMS jump")));
  expectRefused({{"study", "continuity", "analytic:sphere", "--enrich", "-o", at("none")}}, "enrich");
}

}  // namespace cli_continuity_test
}  // namespace hpsdf::app
