// Tests `hpsdf info` and `hpsdf query`, and files that are not fields.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <sstream>
#include <thread>

#include "cli_fixture.h"
#include "commands/point_query.h"
#include "hpsdf/field_file.h"
#include "hpsdf/range.h"
#include "support/one_leaf_field.h"

namespace hpsdf::app {
namespace cli_field_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using FieldFile = Cli;

TEST_F(FieldFile, infoDescribesTheField) {
  const Outcome info = run({{"info", field(), "--json"}});
  ASSERT_EQ(info.status, 0) << info.err;
  EXPECT_THAT(info.err, IsEmpty());
  const Json json = Json::parse(info.out);
  const Field torus = load(field());
  const FieldStatistics counts = statistics(torus);
  EXPECT_EQ(json.at("leaves"), counts.leaves);
  EXPECT_EQ(json.at("coefficients"), counts.coefficients);
  EXPECT_EQ(json.at("bytes"), counts.bytes);
  EXPECT_EQ(json.at("total_error"), torus.metadata().totalError);
  EXPECT_EQ(json.at("target_error"), 1e-4);
  EXPECT_EQ(json.at("rms_estimate"), torus.metadata().rmsEstimate(torus.domain()));
  EXPECT_EQ(json.at("exact_evaluations"), torus.metadata().exactEvaluations);
  EXPECT_EQ(json.at("steps"), torus.metadata().steps.value());
  EXPECT_EQ(json.at("mesh").at("faces"), torus.metadata().source.faces);
  EXPECT_EQ(std::stoull(json.at("mesh").at("fingerprint").get<std::string>(), nullptr, 16),
            torus.metadata().source.fingerprint);
  EXPECT_EQ(json.at("file_bytes"), fs::file_size(field()));
  EXPECT_EQ(json.at("domain")[1][0], torus.domain().max().x());
  for (const char* histogram : {"degree_volume", "depth_volume"}) {
    double sum = 0;
    for (const auto& [level, share] : json.at(histogram).items()) sum += share.get<double>();
    EXPECT_NEAR(sum, 1, 1e-12) << histogram;
  }
  const Outcome text = run({{"info", field()}});
  EXPECT_THAT(text.out, HasSubstr("leaves"));
  EXPECT_THAT(text.out, HasSubstr("▇"));
}

TEST_F(FieldFile, infoTellsOfExactLeaves) {
  const std::string box = at("box.hpsdf");
  const Outcome built = run({{"build", "builtin:box", "-o", box, "--strategy", "hpx", "--target-error", "1e-3"}});
  const FieldStatistics figures = statistics(load(box));
  const FieldBytes bytes = load(box).bytesOfParts();
  const std::string exact = std::to_string(figures.exact.leaves) + " exact";
  ASSERT_GT(figures.exact.leaves, 0u);
  EXPECT_THAT(built.out, AllOf(HasSubstr(exact), HasSubstr(" 12 triangles, ")));
  EXPECT_THAT(run({{"info", box}}).out, AllOf(HasSubstr(exact), ContainsRegex("exact triangles +12; a leaf lists")));
  const Json json = Json::parse(run({{"info", box, "--json"}}).out);
  EXPECT_EQ(json.at("exact_leaves"), Json({{"leaves", figures.exact.leaves},
                                           {"triangles", 12},
                                           {"median_list", figures.exact.medianList},
                                           {"longest_list", figures.exact.longestList}}));
  EXPECT_EQ(json.at("bytes_of_parts").at("exact_triangles"), bytes.exactTriangles);
  EXPECT_EQ(json.at("bytes"), bytes.total());

  EXPECT_THAT(run({{"info", field()}}).out, Not(HasSubstr("exact triangles")));
  EXPECT_FALSE(Json::parse(run({{"info", field(), "--json"}}).out).contains("exact_leaves"));
}

/// Expects that a compressed file is smaller than the one without compression, and loads into the same field.
void expectCompressed(const std::string& compressed, const std::string& plain) {
  EXPECT_LT(fs::file_size(compressed), fs::file_size(plain)) << compressed;
  const std::string again = compressed + ".again";
  save(load(compressed), again);
  EXPECT_EQ(readFile(again), readFile(plain)) << compressed;
  fs::remove(again);
}

TEST_F(FieldFile, commandsThatWriteFieldsCompressThem) {
  const std::vector<std::vector<std::string>> commands = {{"build", "builtin:torus", "--target-error", "1e-4"},
                                                          {"smooth", field()},
                                                          {"blend", field()},
                                                          {"bounds", field(), "builtin:torus"}};
  for (const std::vector<std::string>& words : commands) {
    const auto written = [&](const std::string& name, const std::vector<std::string>& more) {
      std::vector<std::string> all = words;
      all.insert(all.end(), {"-o", at(name)});
      all.insert(all.end(), more.begin(), more.end());
      const Outcome outcome = run({all});
      EXPECT_EQ(outcome.status, 0) << outcome.err;
      return at(name);
    };
    expectCompressed(written("c.hpsdf", {"--compress"}), written("p.hpsdf", {}));
  }
  writeFile(folder_ / "s.txt", "load " + field() + "\nsave output=" + at("s.hpsdf") + " compress=true\n");
  ASSERT_EQ(run({{"run", at("s.txt")}}).status, 0);
  expectCompressed(at("s.hpsdf"), field());
  const Json info = Json::parse(run({{"info", at("s.hpsdf"), "--json"}}).out);
  EXPECT_EQ(info.at("file_bytes"), fs::file_size(at("s.hpsdf"))) << "bytes on disk";
  EXPECT_EQ(info.at("bytes"), load(field()).bytes()) << "bytes in memory";
}

TEST_F(FieldFile, compressionNeedsAnOutput) {
  const std::string script = at("s.txt");
  for (const std::string& line :
       {std::string("build builtin:torus compress=true"), "blend " + field() + " compress=true"}) {
    writeFile(script, line + "\n");
    expectRefused({{"run", script}}, "compress belongs to output: give that too, or leave it out");
  }
  expectRefused({{"build", "builtin:torus", "-o", at("t.hpsdf"), "--compress=19"}}, "compress");
}

TEST_F(FieldFile, damagedFieldsAreRefused) {
  const std::string whole = readFile(field());
  std::mt19937_64 random(5);
  for (int n = 0; n < 40; ++n) {
    std::string bytes = whole;
    const std::size_t at = random() % (n % 4 < 2 ? 400 : whole.size());
    if (n % 2 == 0)
      bytes.resize(at);
    else
      bytes[at] = char(bytes[at] ^ (1 << random() % 8));
    writeFile(this->at("damaged.hpsdf"), bytes);
    expectRefused({{"info", this->at("damaged.hpsdf")}}, "damaged.hpsdf: ");
  }
}

/// The field's metadata contain NaN, infinity, and a name with control characters that would clear the screen.
TEST_F(FieldFile, infoDescribesAnyFieldThatLoads) {
  FieldData data = oneLeafField(1, 2).data();
  data.metadata.source.name = "evil\n\x1b[2J\xff.obj";
  data.metadata.settings.targetError = NAN;
  data.metadata.totalError = -INFINITY;
  save(Field(data), at("evil.hpsdf"));
  const Outcome text = run({{"info", at("evil.hpsdf")}});
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("evil\\n\\x1b[2J\\xff.obj\n"));
  EXPECT_THAT(text.out, HasSubstr("-inf, nan"));
  EXPECT_THAT(text.out, Not(HasSubstr("\x1b")));
  const Outcome json = run({{"info", at("evil.hpsdf"), "--json"}});
  EXPECT_EQ(json.status, 0) << json.err;
  EXPECT_TRUE(Json::parse(json.out).at("target_error").is_null());
}

TEST_F(FieldFile, queryAnswersPoints) {
  const Outcome outcome =
      run({{"query", field()}, "x,y,z\n0.1,0.2,0.3\n\n# a comment\n-0.5 1e-1 0 # here too\n9,9,9\r\n"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, IsEmpty());
  std::istringstream lines(outcome.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x,y,z,distance,gx,gy,gz");
  const Field torus = load(field());
  for (const Vector3& x : {Vector3(0.1, 0.2, 0.3), Vector3(-0.5, 0.1, 0), Vector3(9, 9, 9)}) {
    ASSERT_TRUE(std::getline(lines, line));
    std::ranges::replace(line, ',', ' ');
    std::istringstream numbers(line);
    std::array<double, 7> row{};
    for (double& number : row) numbers >> number;
    const auto [value, gradient] = torus.valueAndGradient(x);
    EXPECT_THAT(row, ElementsAre(x.x(), x.y(), x.z(), value, gradient.x(), gradient.y(), gradient.z()));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(FieldFile, queryReadsAndWritesFiles) {
  writeFile(at("points.txt"), "0 0 0\n1 1 1");
  const Outcome toFile = run({{"query", field(), at("points.txt"), "-o", at("out.csv")}});
  EXPECT_EQ(toFile.status, 0) << toFile.err;
  EXPECT_EQ(readFile(at("out.csv")), run({{"query", field()}, "0 0 0\n1 1 1\n"}).out);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("out.csv", "points.txt"));
  EXPECT_EQ(run({{"query", field(), "--json"}, ""}).out, "[]\n");
}

TEST_F(FieldFile, errorsAreOneLineForAnyName) {
  const std::pair<const char*, const char*> names[] = {
      {"two\nlines", "two\\nlines"},
      {"tab\tand\rreturn", "tab\\tand\\rreturn"},
      {"\x1b[2Jclear\x7f", "\\x1b[2Jclear\\x7f"},
      {"next\xc2\x85line", "next\\u0085line"},
      {"grün 東京 😀 \\n", "grün 東京 😀 \\n"},
      {"\xfc", "\\xfc"},                                        // ü in Latin-1
      {"\xe6\x9d", "\\xe6\\x9d"},                               // the begin of a character
      {"\xc0\xaf \xe0\x80\xaf", "\\xc0\\xaf \\xe0\\x80\\xaf"},  // longer than need be
      {"\xed\xa0\x80", "\\xed\\xa0\\x80"},                      // half of a surrogate pair
      {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"}};            // beyond the last character
  for (const auto& [name, shown] : names)
    expectRefused({{"info", at(name + std::string(".hpsdf"))}}, at(shown + std::string(".hpsdf: no such file")));
}

TEST_F(FieldFile, badPointsAreRefusedByLine) {
  for (const char* bad : {"1 2", "1 2 3 4", "a b c", "1,,2", "1 2 3x", "nan 0 0", "1 inf 2", ",1,2,3"}) {
    writeFile(at("points.txt"), "0 0 0\n" + std::string(bad) + "\n");
    expectRefused({{"query", field(), at("points.txt"), "-o", at("out.csv")}}, "points.txt:2: expected three finite");
  }
  writeFile(at("points.txt"), "1 2 \x1b[2J\n");
  expectRefused({{"query", field(), at("points.txt")}}, "found '1 2 \\x1b[2J'");
  const Outcome first = run({{"query", field()}, "nan,nan,nan\n"});
  EXPECT_EQ(first.status, 2);
  EXPECT_THAT(first.err, HasSubstr("stdin:1: expected three finite numbers"));
  EXPECT_EQ(run({{"query", field(), "0.1,-2e-1,0.3"}}).out, run({{"query", field()}, "0.1 -2e-1 0.3\n"}).out);
  EXPECT_EQ(run({{"query", field(), "-0.1,0.2,0.3"}}).out, run({{"query", field()}, "-0.1 0.2 0.3\n"}).out);
  EXPECT_EQ(run({{"query", field(), "-.1,.2,0.3"}}).out, run({{"query", field()}, "-0.1 0.2 0.3\n"}).out);
  expectRefused({{"info", "-.5x.hpsdf"}}, "unknown option '-.5x.hpsdf'");
  EXPECT_EQ(run({{"query", field(), "0,0,0", "-o", at("one.csv")}}).err, at("one.csv") + ": 1 point\n");
  expectRefused({{"query", field(), "1,2"}}, "1,2:1: expected three finite");
  expectRefused({{"query", field(), at("none.txt")}}, "none.txt: no such file");
  for (const std::string name : {"a,b,c", "E,1,2", "e", "123"})
    expectRefused({{"query", field(), name}}, name + ": no such file");
  expectRefused({{"query", field(), folder_.path().string()}}, "is a folder");
}

TEST_F(FieldFile, queryFindsRangesOverBoxes) {
  writeFile(at("boxes.txt"), "x0,y0,z0,x1,y1,z1\n0,0,0,0.2,0.2,0.2 # a comment\n\n-0.5 -0.5 -0.5 9 9 9\n");
  const Outcome outcome = run({{"query", field(), "--boxes", at("boxes.txt")}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x0,y0,z0,x1,y1,z1,min,max");
  const Field torus = load(field());
  const RangeIndex index(torus);
  for (const Box& box :
       {Box(Vector3::Zero(), Vector3::Constant(0.2)), Box(Vector3::Constant(-0.5), Vector3::Constant(9))}) {
    ASSERT_TRUE(std::getline(lines, line));
    std::ranges::replace(line, ',', ' ');
    std::istringstream numbers(line);
    std::array<double, 8> row{};
    for (double& number : row) numbers >> number;
    const Interval range = index.range(box).value;
    EXPECT_THAT(row, ElementsAre(box.min().x(), box.min().y(), box.min().z(), box.max().x(), box.max().y(),
                                 box.max().z(), range.min, range.max));
  }
  EXPECT_FALSE(std::getline(lines, line));
  EXPECT_EQ(run({{"query", field(), "--boxes", "-"}, readFile(at("boxes.txt"))}).out, outcome.out);
  const Outcome toFile = run({{"query", field(), "--boxes", at("boxes.txt"), "-o", at("out.csv")}});
  EXPECT_EQ(toFile.err, at("out.csv") + ": 2 boxes\n");
  EXPECT_EQ(readFile(at("out.csv")), outcome.out);
}

TEST_F(FieldFile, rangesOfTheExactDistanceNeedBounds) {
  ASSERT_EQ(run({{"bounds", field(), "-o", at("bounded.hpsdf")}}).status, 0);
  const Outcome outcome = run({{"query", at("bounded.hpsdf"), "--boxes", "0,0,0,0.2,0.2,0.2", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json box = Json::parse(outcome.out).at(0);
  EXPECT_LT(box.at("exact_min").get<double>(), box.at("min").get<double>());
  EXPECT_GT(box.at("exact_max").get<double>(), box.at("max").get<double>());
  EXPECT_EQ(box.at("x1"), 0.2);
}

TEST_F(FieldFile, badBoxesAreRefusedByLine) {
  const auto refused = [&](const std::string& bad, const std::string& message) {
    writeFile(at("boxes.txt"), "0 0 0 1 1 1\n" + bad + "\n");
    expectRefused({{"query", field(), "--boxes", at("boxes.txt"), "-o", at("out.csv")}}, "boxes.txt:2: " + message);
  };
  for (const char* bad : {"1 2 3", "1 2 3 4 5", "1 2 3 4 5 6 7", "0,0,0,,1,1", "0 0 0 1 1 nan", "0 0 0 inf 1 1"})
    refused(bad, "expected six finite numbers");
  refused("0 1 0 1 0.5 1", "the box is empty along y: the lower corner comes first, give 0.5 before 1");
  expectRefused({{"query", field(), "0,0,0", "--boxes", "-"}}, "boxes excludes points: give one of them");
  expectRefused({{"query", field(), "--boxes", at("none.txt")}}, "none.txt: no such file");
}

/// A program that sends one point at a time gets each answer before it sends the next point.
TEST_F(FieldFile, queriesOnAPipeAreAnsweredAtOnce) {
  Process process({.words = {"query", field()}, .keepInputOpen = true});
  process.type("0 0 0\n");
  process.waitForLines(2);
  process.type("1 1 1\n");
  process.waitForLines(3);
  process.closeInput();
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(lineCount(outcome.out), 3u);
}

TEST(PointQuery, answersManyBatchesInOrder) {
  const Field field(FieldData{.domain = Box(Vector3::Zero(), Vector3::Ones()),
                              .nodes = {node::leaf(0, 0)},
                              .coefficients = std::vector<double>{0.25},
                              .metadata = {}});
  std::string text;
  constexpr std::size_t kPoints = 40000;
  for (std::size_t i = 0; i < kPoints; ++i) text += "0.5 0.5 " + std::to_string(double(i % 100) / 100) + "\n";
  std::istringstream in(text);
  std::string out;
  std::size_t writes = 0;
  EXPECT_EQ(queryPoints(field, in, "points", PointFormat::json,
                        [&](std::string_view part) {
                          out += part;
                          ++writes;
                        }),
            kPoints);
  EXPECT_GT(writes, 2u);
  const Json json = Json::parse(out);
  ASSERT_EQ(json.size(), kPoints);
  for (std::size_t i = 0; i < kPoints; i += 997) {
    EXPECT_EQ(json[i].at("z"), double(i % 100) / 100);
    EXPECT_EQ(json[i].at("distance"), 0.25);
  }
}

/// In a script, the only word may be the mesh; files are told apart by their first bytes and their names.
TEST_F(FieldFile, aMeshAloneIsNotTakenForAField) {
  writeFile(at("t.obj"), kTetrahedron);
  writeFile(at("notes.txt"), "no field, no mesh");
  const std::string build = "build " + at("t.obj") + " target-error=1e-3 output=" + at("t.hpsdf");
  const auto script = [&](const std::string& line) { return run({{"run", "-e", build, "-e", line}}); };
  for (const std::string command : {"verify", "bounds"}) {
    const std::string points = command == "verify" ? " points=1000" : " output=" + at("b.hpsdf");
    for (const std::string& words :
         {at("t.obj"), at("t.hpsdf"), at("t.hpsdf") + " " + at("t.obj"), "mesh=" + at("t.obj"), std::string()}) {
      const Outcome outcome = script(command + " " + words + points);
      EXPECT_EQ(outcome.status, 0) << command << " " << words << outcome.err;
    }
    // A field that was read from a file does not know where its mesh is, unless that lies beside it.
    fs::create_directories(at("alone"));
    fs::copy(at("t.hpsdf"), at("alone"), fs::copy_options::overwrite_existing);
    const Outcome alone = script(command + " " + at("alone/t.hpsdf") + points);
    EXPECT_EQ(alone.status, 2);
    EXPECT_THAT(alone.err, HasSubstr("give MESH, t.obj"));
    const Outcome named = script(command + " field=" + at("t.obj") + points);
    EXPECT_EQ(named.status, 2);
    EXPECT_THAT(named.err, HasSubstr("t.obj: this is a mesh or a shape, not a field"));
    const Outcome neither = script(command + " " + at("notes.txt") + points);
    EXPECT_EQ(neither.status, 2);
    EXPECT_THAT(neither.err, HasSubstr("notes.txt: this is neither a field nor a mesh"));
    const Outcome swapped = script(command + " " + at("t.obj") + " " + at("t.hpsdf") + points);
    EXPECT_EQ(swapped.status, 2);
    EXPECT_THAT(swapped.err, HasSubstr("t.obj: this is a mesh or a shape; give the file of a field (*.hpsdf) first"));
  }
  const Outcome alone = run({{"verify", at("t.obj")}});
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr("t.obj: this is a mesh or a shape; give the file of a field (*.hpsdf) first"));
  // The first bytes decide, not the name.
  std::filesystem::copy_file(at("t.hpsdf"), at("field.obj"));
  const Outcome misnamed = run({{"verify", at("field.obj"), at("t.obj"), "--points", "1000"}});
  EXPECT_EQ(misnamed.status, 0) << misnamed.err;
}

TEST_F(FieldFile, badFieldFilesAreRefused) {
  const std::string good = readFile(field());
  const auto variant = [&](const std::string& name, const std::string& bytes) { writeFile(at(name), bytes); };
  variant("truncated.hpsdf", good.substr(0, good.size() / 2));
  variant("short.hpsdf", good.substr(0, 5));
  variant("empty.hpsdf", "");
  variant("foreign.hpsdf", std::string(kTetrahedron));
  variant("longer.hpsdf", good + "x");
  for (const std::size_t byte : {good.size() / 3, good.size() - 100, std::size_t{100}}) {
    std::string altered = good;
    altered[byte] = static_cast<char>(altered[byte] ^ 0x10);
    variant("altered" + std::to_string(byte) + ".hpsdf", altered);
  }
  std::string version = good;
  version[8] = 13;  // docs/file-format.md: the version follows 8 bytes of magic, and 12 is the greatest
  variant("newer.hpsdf", version);
  fs::create_directory(at("folder.hpsdf"));
  const auto before = namesIn(folder_.path());
  for (std::string name : before) {
    expectRefused({{"info", at(name)}}, name, before);
    expectRefused({{"slice", at(name), "-o", at("s.png"), "--cpu"}}, name, before);
    expectRefused({{"query", at(name), "-o", at("q.csv")}, "0 0 0\n"}, name, before);
  }
  expectRefused({{"info", at("newer.hpsdf")}}, "version 13", before);
  expectRefused({{"info", at("missing.hpsdf")}}, "missing.hpsdf", before);
}

/// Another thread creates and removes the file; the program must print the file's content or one line of error.
TEST_F(FieldFile, fileThatAppearsAndDisappearsIsReadOrRefused) {
  std::atomic<bool> over = false;
  std::thread other([&] {
    for (bool there = false; !over; there = !there) {
      if (there)
        fs::remove(at("f.hpsdf"));
      else
        fs::create_hard_link(field(), at("f.hpsdf"));
    }
  });
  int refused = 0, read = 0;
  const auto start = Clock::now();
  for (int n = 0; n < 300 || ((refused == 0 || read == 0) && Clock::now() - start < std::chrono::seconds(20)); ++n) {
    const Outcome outcome = runHere({"info", at("f.hpsdf")});
    ++(outcome.status == 0 ? read : refused);
    if (outcome.status == 0) continue;
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("f.hpsdf"), Not(HasSubstr("fault of the program"))));
  }
  over = true;
  other.join();
  EXPECT_GT(refused, 0);
  EXPECT_GT(read, 0);
}

}  // namespace cli_field_test
}  // namespace hpsdf::app
