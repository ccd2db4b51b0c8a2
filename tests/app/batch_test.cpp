// Tests batches of meshes: their lists, parts, records, scripts and pages, and processes that are killed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "batch/batch_list.h"
#include "cli_fixture.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "language/script.h"

namespace hpsdf::app {
namespace batch_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using testing::Contains;
using testing::Each;
using testing::SizeIs;

std::vector<std::string> surfacesIn(std::string_view list) {
  std::vector<std::string> surfaces;
  for (const BatchMesh& mesh : parseBatchList(list)) surfaces.push_back(mesh.surface);
  return surfaces;
}

std::string nameOf(const std::string& surface) {
  const std::vector<BatchMesh> meshes = parseBatchList(surface);
  return meshes.size() == 1 ? meshes[0].name : "";
}

TEST(BatchLists, holdOneMeshALine) {
  EXPECT_THAT(surfacesIn("a.obj\n# no mesh\n\n  b c.stl\t\r\n#d.obj\n./#e.obj\nbuiltin:torus,major=1\nlast.ply"),
              ElementsAre("a.obj", "b c.stl", "./#e.obj", "builtin:torus,major=1", "last.ply"));
  EXPECT_THAT(surfacesIn("\xef\xbb\xbf# as some editors begin\na.obj\r\n"), ElementsAre("a.obj"));
  EXPECT_THAT(surfacesIn("a.obj\nb.obj\n a.obj\n"), ElementsAre("a.obj", "b.obj")) << "each once";
  EXPECT_THAT(surfacesIn(" \n\r\n# \n"), IsEmpty());
}

/// `find -print0` and some editors write lists that contain zero bytes.
TEST(BatchLists, withZeroBytesAreRefused) {
  const auto complaint = [](std::string_view list) {
    try {
      parseBatchList(list);
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  using namespace std::string_view_literals;
  EXPECT_EQ(complaint("a.obj\0b.obj\0"sv), "line 1 holds a zero byte: expected one name a line, in UTF-8");
  EXPECT_THAT(complaint("a.obj\n\n#\0\n"sv), StartsWith("line 3 holds a zero byte"));
  EXPECT_THAT(complaint("\xff\xfe.\0/\0t\0.\0o\0b\0j\0\n\0"sv), StartsWith("line 1 holds a zero byte"));
}

TEST(BatchLists, namesAreSafeAndDependOnTheLineAlone) {
  EXPECT_THAT(nameOf("scans/bunny.obj"), testing::MatchesRegex("bunny-[0-9a-f]{16}"));
  EXPECT_THAT(nameOf("builtin:torus,major=0.7,minor=0.2"), StartsWith("torus_major_0.7_minor_0.2-"));
  EXPECT_THAT(nameOf("../a b$(c)'\"*\xc3\xa4.stl"), StartsWith("a_b__c______-"));
  EXPECT_THAT(nameOf("a/.stl"), StartsWith("_stl-")) << "a hidden file looks like none";
  EXPECT_THAT(nameOf("../.."), Not(HasSubstr("/")));
  EXPECT_LT(nameOf(std::string(255, 'x')).size(), 200u);
  EXPECT_EQ(nameOf("b.obj"), parseBatchList("a.obj\nb.obj\nc.obj")[1].name) << "whatever else is in the list";
  std::set<std::string> names;
  for (const char* surface : {"a/t.obj", "b/t.obj", "a/t.stl", "./a/t.obj", "builtin:box", "analytic:box", "box",
                              "builtin:box,width=1", "builtin:box,width_1"})
    names.insert(nameOf(surface));
  EXPECT_THAT(names, SizeIs(9));
}

TEST(BatchLists, partsHoldEachMeshOnce) {
  std::string list;
  for (int n = 0; n < 11; ++n) list += fmt::format("{}.obj\n", n);
  const std::vector<BatchMesh> meshes = parseBatchList(list);
  for (const int count : {1, 2, 3, 11, 20}) {
    std::vector<std::string> names;
    for (int part = 1; part <= count; ++part) {
      const std::vector<BatchMesh> chosen = partOf(meshes, fmt::format("{}/{}", part, count));
      EXPECT_LE(chosen.size(), (meshes.size() + count - 1) / count);
      for (const BatchMesh& mesh : chosen) names.push_back(mesh.name);
    }
    std::vector<std::string> all;
    for (const BatchMesh& mesh : meshes) all.push_back(mesh.name);
    EXPECT_THAT(names, testing::UnorderedElementsAreArray(all)) << count;
  }
  EXPECT_EQ(partOf(meshes, "2/3")[0].surface, "1.obj");
  for (const char* wrong :
       {"", "1", "0/3", "4/3", "1/0", "/", "1/", "/2", "-1/2", "1/2x", " 1/2", "1.5/2", "1/99999999999999999999"})
    EXPECT_THROW(partOf(meshes, wrong), Error) << wrong;
}

std::string tetrahedron(double height) {
  return fmt::format("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n", height);
}

std::vector<Json> linesOf(const Outcome& outcome) {
  std::vector<Json> lines;
  std::istringstream text(outcome.out);
  for (std::string line; std::getline(text, line);) lines.push_back(Json::parse(line));
  return lines;
}

std::vector<std::string> statusesOf(const Outcome& outcome) {
  std::vector<std::string> statuses;
  for (const Json& line : linesOf(outcome)) statuses.push_back(line.at("status"));
  return statuses;
}

class Batches : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  fs::path fields() const { return folder_ / "fields"; }
  /// Returns the file of the field that is built for a line of the list.
  fs::path fieldOf(const std::string& surface) const { return fields() / (nameOf(surface) + ".hpsdf"); }

  /// Returns a call that builds the given list with options.
  Call batch(const std::string& list, const std::vector<std::string>& options = {}) const {
    writeFile(folder_ / "list", list);
    Call call{.words = {"build", "--batch", "list", "-o", "fields"}, .folder = folder_.path()};
    call.words.insert(call.words.end(), options.begin(), options.end());
    return call;
  }

  /// Returns the bytes of the field that `hpsdf build` gives for this mesh without a batch.
  std::string loneBytes(const std::string& surface, const std::vector<std::string>& options) const {
    Call call{.words = {"build", surface, "-o", "lone.hpsdf"}, .folder = folder_.path()};
    call.words.insert(call.words.end(), options.begin(), options.end());
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return readFile(folder_ / "lone.hpsdf");
  }

  /// Returns the record of the mesh that a line of the list names.
  fs::path recordOf(const std::string& surface) const { return fields() / (nameOf(surface) + ".json"); }

  /// Returns the names of all files in the folder of the fields but the records.
  std::set<std::string> fieldNames() const {
    std::set<std::string> names = namesIn(fields());
    std::erase_if(names, [](const std::string& name) { return name.ends_with(".json"); });
    return names;
  }

  void expectRefused(const Call& call, const std::string& message) const {
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
    EXPECT_THAT(outcome.err, AllOf(StartsWith("hpsdf: error: "), HasSubstr(message)));
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_FALSE(fs::is_directory(fields()));
  }

  support::TemporaryDirectory folder_;
};

const std::vector<std::string> kCoarse = {"--target-error", "1e-3", "--grid", "2"};

std::vector<std::string> coarseAnd(const std::vector<std::string>& more) {
  std::vector<std::string> options = kCoarse;
  options.insert(options.end(), more.begin(), more.end());
  return options;
}

TEST_F(Batches, badMeshDoesNotStopTheOthers) {
  writeFile(folder_ / "t.obj", tetrahedron(1));
  writeFile(folder_ / "bad.obj", "this is no mesh\n");
  const Outcome outcome = run(batch("t.obj\nbad.obj\nbuiltin:tours\n# no mesh\nanalytic:sphere\n", kCoarse));
  EXPECT_EQ(outcome.status, 3);
  const std::vector<Json> lines = linesOf(outcome);
  ASSERT_THAT(statusesOf(outcome), ElementsAre("built", "failed", "failed", "built"));
  EXPECT_EQ(lines[0].at("file"), "t.obj");
  EXPECT_EQ(lines[0].at("output"), "fields/" + nameOf("t.obj") + ".hpsdf");
  EXPECT_EQ(lines[0].at("sign"), "pseudonormal");
  EXPECT_TRUE(lines[0].at("error").is_null());
  EXPECT_GT(lines[0].at("seconds"), 0);
  const Field field = load(fieldOf("t.obj"));
  EXPECT_EQ(lines[0].at("leaves"), statistics(field).leaves);
  EXPECT_EQ(lines[0].at("bytes"), statistics(field).bytes);
  EXPECT_EQ(lines[0].at("file_bytes"), fs::file_size(fieldOf("t.obj")));
  EXPECT_EQ(lines[0].at("rms_estimate"), field.metadata().rmsEstimate(field.domain()));
  EXPECT_THAT(lines[1].at("error").get<std::string>(), StartsWith("bad.obj: "));
  EXPECT_TRUE(lines[1].at("leaves").is_null());
  EXPECT_TRUE(lines[3].at("sign").is_null()) << "no mesh, no way to find its sign";
  EXPECT_THAT(outcome.err, HasSubstr("\nhpsdf: error: 2 of 4: bad.obj: "));
  EXPECT_THAT(outcome.err, HasSubstr("\nhpsdf: error: 3 of 4: builtin:tours: there is no shape"));
  EXPECT_THAT(outcome.err, HasSubstr("\n4 of 4: analytic:sphere: built, "));
  EXPECT_THAT(outcome.err, EndsWith("hpsdf: error: list: 2 of 4 meshes failed; the lines above say why\n"));
  EXPECT_THAT(fieldNames(), ElementsAre(nameOf("analytic:sphere") + ".hpsdf", nameOf("t.obj") + ".hpsdf"));
  for (const char* surface : {"t.obj", "analytic:sphere"})
    EXPECT_TRUE(readFile(fieldOf(surface)) == loneBytes(surface, kCoarse)) << surface;
}

/// The cells of the larger sphere may not be divided often enough for the maximum error, which is a length.
TEST_F(Batches, fieldsAreCompressed) {
  writeFile(folder_ / "t.obj", tetrahedron(1));
  const fs::path file = fieldOf("t.obj");
  const std::vector<std::string> options = {"--target-error=1e-3", "--grid=3"};
  EXPECT_THAT(statusesOf(run(batch("t.obj\n", options))), ElementsAre("built"));
  const std::uintmax_t plain = fs::file_size(file);
  EXPECT_THAT(statusesOf(run(batch("t.obj\n", {options[0], options[1], "--compress"}))), ElementsAre("built"));
  EXPECT_LT(fs::file_size(file), plain);
  save(load(file), file);
  EXPECT_EQ(fs::file_size(file), plain) << "the field is the same";
}

TEST_F(Batches, fieldsThatMissTheErrorsAskedForAreTold) {
  const std::vector<std::string> options = {"--max-error",  "0.01", "--target-error", "1e-2", "--strategy", "hp",
                                            "--max-degree", "2",    "--max-depth",    "1",    "--grid",     "2"};
  const char* small = "analytic:sphere,radius=0.01";
  const Call call = batch("analytic:sphere\nanalytic:sphere,radius=0.01\n", options);
  const Outcome outcome = run(call);
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  const std::vector<Json> lines = linesOf(outcome);
  ASSERT_THAT(statusesOf(outcome), ElementsAre("built", "built"));
  EXPECT_THAT(lines[0].at("missed").get<std::string>(), StartsWith("max-error: an error of "));
  EXPECT_TRUE(lines[1].at("missed").is_null());
  EXPECT_TRUE(lines[0].at("error").is_null());
  EXPECT_THAT(outcome.err, HasSubstr("\nhpsdf: warning: 1 of 2: analytic:sphere: max-error: an error of "));
  EXPECT_THAT(outcome.err,
              EndsWith("list: 1 of 2 fields miss the errors that were asked for; the lines above say by how "
                       "much\n"));
  EXPECT_TRUE(readFile(fieldOf(small)) == loneBytes(small, options));
  EXPECT_TRUE(fs::exists(fieldOf("analytic:sphere")));
  const Outcome again = run(call);
  EXPECT_EQ(again.status, 1) << "skipped fields miss it as before";
  EXPECT_EQ(linesOf(again)[0].at("missed"), lines[0].at("missed"));
  EXPECT_EQ(run(batch("analytic:sphere\nbuiltin:tours\n", options)).status, 3) << "failures are worse";
}

TEST_F(Batches, fieldsWithinAToleranceHaveNoEstimate) {
  const Outcome outcome = run(batch("builtin:box\n", {"--tolerance", "5%", "--grid", "2"}));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const Json line = linesOf(outcome).at(0);
  EXPECT_TRUE(line.at("missed").is_null());
  EXPECT_TRUE(line.at("rms_estimate").is_null());
}

TEST_F(Batches, finishedFieldsAreSkipped) {
  writeFile(folder_ / "t.obj", tetrahedron(1));
  const Call call = batch("t.obj\nbuiltin:box\nanalytic:box\n", coarseAnd({"--normalize"}));
  ASSERT_EQ(run(call).status, 0);
  std::map<std::string, fs::file_time_type> written;
  for (const auto& entry : fs::recursive_directory_iterator(fields())) written[entry.path()] = entry.last_write_time();
  EXPECT_THAT(written, SizeIs(6)) << "fields and their records";
  const std::string before = readFile(fieldOf("t.obj"));
  const Outcome again = run(call);
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(statusesOf(again), ElementsAre("skipped", "skipped", "skipped"));
  EXPECT_EQ(linesOf(again)[0].at("leaves"), statistics(load(fieldOf("t.obj"))).leaves);
  EXPECT_THAT(again.err, HasSubstr("0 built, 3 skipped, 0 failed"));
  for (const auto& entry : fs::recursive_directory_iterator(fields()))
    EXPECT_EQ(entry.last_write_time(), written.at(entry.path())) << entry.path();
  EXPECT_TRUE(readFile(fieldOf("t.obj")) == before);
  // The field is independent of the number of threads, of the rest of the list and of checkpoints.
  EXPECT_THAT(
      statusesOf(run(batch("builtin:box\nt.obj", coarseAnd({"--normalize", "--threads", "1", "--checkpoint"})))),
      ElementsAre("skipped", "skipped"));
}

TEST_F(Batches, changedMeshesAndOptionsAreBuiltAgain) {
  writeFile(folder_ / "t.obj", tetrahedron(1));
  writeFile(folder_ / "other.obj", tetrahedron(1));
  const std::string list = "t.obj\nother.obj\n";
  const auto statuses = [&](const std::vector<std::string>& options) { return statusesOf(run(batch(list, options))); };
  EXPECT_THAT(statuses(kCoarse), ElementsAre("built", "built"));
  // The mesh's content changes, but its file size and modification time stay the same.
  const auto time = fs::last_write_time(folder_ / "t.obj");
  writeFile(folder_ / "t.obj", tetrahedron(2));
  fs::last_write_time(folder_ / "t.obj", time);
  EXPECT_THAT(statuses(kCoarse), ElementsAre("built", "skipped"));
  EXPECT_TRUE(readFile(fieldOf("t.obj")) == loneBytes("t.obj", kCoarse));
  // A changed option causes another construction.
  for (const char* option : {"--bounds", "--normalize"}) {
    EXPECT_THAT(statuses(coarseAnd({option})), ElementsAre("built", "built")) << option;
    EXPECT_TRUE(readFile(fieldOf("t.obj")) == loneBytes("t.obj", coarseAnd({option})));
  }
  EXPECT_THAT(statuses(coarseAnd({"--paper"})), ElementsAre("built", "built"));
  EXPECT_THAT(statuses(coarseAnd({"--paper", "--quadrature", "3"})), ElementsAre("built", "built"))
      << "the default, which is not what --paper takes";
  EXPECT_THAT(statuses(coarseAnd({"--paper", "--quadrature", "3"})), ElementsAre("skipped", "skipped"));
  EXPECT_THAT(statuses(kCoarse), ElementsAre("built", "built"));
  // After the mesh file is removed, the batch reports a failure and keeps the old field.
  fs::remove(folder_ / "t.obj");
  EXPECT_THAT(statuses(kCoarse), ElementsAre("failed", "skipped"));
  EXPECT_TRUE(fs::exists(fieldOf("t.obj")));
}

TEST_F(Batches, damagedFieldsAreBuiltAgain) {
  const std::string list = "builtin:box\nbuiltin:box,width=1\n";
  const Call call = batch(list, kCoarse);
  ASSERT_EQ(run(call).status, 0);
  const fs::path field = fieldOf("builtin:box");
  const std::string good = readFile(field);
  std::string flipped = good;
  flipped[good.size() / 2] = char(flipped[good.size() / 2] ^ 1);
  const std::string other = readFile(fieldOf("builtin:box,width=1"));
  for (const std::string& bytes : {flipped, good.substr(0, good.size() / 2), std::string(), good + good, other}) {
    writeFile(field, bytes);
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(statusesOf(outcome), ElementsAre("built", "skipped"));
    EXPECT_TRUE(readFile(field) == good);
    if (bytes == flipped) {
      EXPECT_THAT(outcome.err, AllOf(HasSubstr("hpsdf: note: "), HasSubstr("; building it again\n")));
    }
  }
  // A field without the record of its options is built again.
  fs::remove(recordOf("builtin:box"));
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built", "skipped"));
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("skipped", "skipped"));
}

/// Returns a binary glTF file: a header, a JSON chunk and a chunk with the first buffer.
std::string binaryGltf(std::string json, const std::string& buffer) {
  const auto words = [](const std::vector<std::uint32_t>& numbers) {
    return std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof numbers[0]);
  };
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto jsonSize = std::uint32_t(json.size()), bufferSize = std::uint32_t(buffer.size());
  return words({0x46546c67, 2, 28 + jsonSize + bufferSize, jsonSize, 0x4e4f534a}) + json +
         words({bufferSize, 0x004e4942}) + buffer;
}

/// The glTF files stay the same while the files to which they refer change.
TEST_F(Batches, filesOfAGltfFileCount) {
  const auto corners = [&](float height) {
    const std::array<float, 12> numbers = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, height};
    writeFile(folder_ / "t.bin", {reinterpret_cast<const char*>(numbers.data()), sizeof numbers});
  };
  const auto json = [](const std::string& faces) {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
           R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
           R"("buffers":[{"byteLength":12)" +
           faces +
           R"(},{"byteLength":48,"uri":"t.bin"}],)"
           R"("bufferViews":[{"buffer":1,"byteLength":48},{"buffer":0,"byteLength":12}],)"
           R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
           R"({"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}]})";
  };
  writeFile(folder_ / "t.gltf", json(R"(,"uri":"data:application/octet-stream;base64,AAIBAAEDAQIDAAMC")"));
  writeFile(folder_ / "b.glb", binaryGltf(json(""), {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}));
  const Call call = batch("t.gltf\nb.glb\n", kCoarse);
  corners(1);
  const Outcome first = run(call);
  EXPECT_THAT(statusesOf(first), ElementsAre("built", "built")) << first.err;
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("skipped", "skipped"));
  corners(2);
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built", "built"));
}

/// The list names an open mesh, whose inside test is reported, a file that is not a mesh, and a missing file.
TEST_F(Batches, controlCharactersInNamesAreNotPrinted) {
  const std::string open = tetrahedron(1).substr(0, tetrahedron(1).rfind("f ")), clear = "\x1b[2J";
  writeFile(folder_ / (clear + "open.obj"), open);
  writeFile(folder_ / (clear + "bad.obj"), "this is no mesh\n");
  const std::string list = clear + "open.obj\n" + clear + "bad.obj\n" + clear + "none.obj\n";
  const Outcome outcome = run(batch(list, kCoarse));
  EXPECT_THAT(statusesOf(outcome), ElementsAre("built", "failed", "failed"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("\x1b")));
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("\nhpsdf: error: 2 of 3: \\x1b[2Jbad.obj: "), HasSubstr("1 of 3: \\x1b[2Jopen.obj: ")));
  EXPECT_THAT(outcome.err, Not(HasSubstr("none.obj: \\x1b[2Jnone.obj: "))) << "once is enough";
  EXPECT_EQ(linesOf(outcome)[0].at("file"), clear + "open.obj") << "as the list has it";
}

TEST_F(Batches, listsAreReadFromStandardInput) {
  Call call{.words = {"build", "--batch", "-", "-o", at("fields"), "--json"}, .input = "builtin:box\n"};
  call.words.insert(call.words.end(), kCoarse.begin(), kCoarse.end());
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built"));
  EXPECT_THAT(fieldNames(), ElementsAre(nameOf("builtin:box") + ".hpsdf"));
}

TEST_F(Batches, scriptsBuildBatches) {
  writeFile(folder_ / "list", "builtin:box\nmissing.obj\n");
  const Outcome outcome = run(
      {.words = {"run", "-e", "build batch=list output=fields target-error=1e-3 grid=2"}, .folder = folder_.path()});
  EXPECT_EQ(outcome.status, 3);
  EXPECT_THAT(statusesOf(outcome), ElementsAre("built", "failed"));
  EXPECT_THAT(outcome.err, HasSubstr("hpsdf: error: -e:1:1: list: 1 of 2 meshes failed"));
}

TEST_F(Batches, mistakesAreRefusedBeforeWork) {
  const std::string list = "builtin:box\nbuiltin:gear\n";
  Call both = batch(list);
  both.words.emplace_back("builtin:box");
  expectRefused(both, "leave MESH out");
  expectRefused({{"run", "-e", "build batch=list"}}, "give output");
  expectRefused({{"build", "--batch", at("none"), "-o", at("fields")}}, at("none") + ": no such file");
  expectRefused(batch("# none\n\n"), "list: names no mesh");
  expectRefused(batch(std::string("builtin:box\0builtin:gear", 24)), "list: line 1 holds a zero byte");
  expectRefused(batch(list, {"--part", "3/2"}), "part: '3/2' is no part of a list: expected K/N");
  expectRefused(batch(list, {"--then", "none.hps"}), "none.hps: no such file");
  expectRefused({{"build", "builtin:box", "-o", at("fields"), "--part", "1/2"}},
                "part belongs to batch: give that too, or leave it out");
  expectRefused(batch(list, {"--near-error", "1e-3"}), "near error and far error belong together");
  expectRefused(batch(list, {"--continuity-weight", "1"}), "continuity-weight belongs to");
  expectRefused(batch(list, {"--sign", "unsigned-shell"}), "thickness");
  expectRefused(batch(list, {"--domain", "1,1,1,0,0,0"}), "expected lower corner");
  expectRefused(batch(list, {"--grid", "100000"}), "base grid 100000");
  const Call call = batch(list);
  writeFile(fields(), "a file\n");
  expectRefused(call, "fields: cannot make this folder (");
}

TEST_F(Batches, listsThatAreNotTextAreRefused) {
  expectRefused({{"build", "--batch", "/dev/zero", "-o", at("fields")}}, "/dev/zero: is a device");
  const Call call = batch("builtin:box\n");
  fs::resize_file(folder_ / "list", kMostTextBytes + 1);
  expectRefused(call, "list: is longer than 67108864 bytes");
}

/// The error appears before the mesh is read: reading would take time, and this mesh does not exist.
TEST_F(Batches, unwritableFieldsAreNotBuilt) {
  const auto errorOf = [&](const char* surface) {
    const Outcome outcome = run(batch(surface, kCoarse));
    EXPECT_EQ(outcome.status, 3);
    EXPECT_THAT(statusesOf(outcome), ElementsAre("failed"));
    return outcome.status == 3 ? linesOf(outcome)[0].at("error").get<std::string>() : outcome.err;
  };
  fs::create_directories(fieldOf("none.obj"));
  EXPECT_THAT(errorOf("none.obj"), EndsWith(".hpsdf: is a folder; give a file name"));
  fs::create_directories(recordOf("analytic:box"));
  EXPECT_THAT(errorOf("analytic:box"), EndsWith(".json: is a folder; give a file name"));
}

TEST_F(Batches, aReaderThatHasGoneEndsTheWork) {
  Call call = batch("builtin:box\nbuiltin:gear\n", kCoarse);
  call.stdoutClosed = true;
  const Outcome outcome = run(call);
  EXPECT_EQ(outcome.status, 141);
  EXPECT_THAT(outcome.err, Not(HasSubstr("error")));
  EXPECT_THAT(fieldNames(), SizeIs(1));
}

TEST_F(Batches, interruptKeepsFinishedFields) {
  const std::string list = "analytic:sphere\nbuiltin:gear\nbuiltin:box\n";
  Process process(batch(list, {"--target-error", "1e-10"}));
  process.waitForLines(1);
  process.send(SIGINT);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 130);
  EXPECT_THAT(statusesOf(outcome), ElementsAre("built"));
  EXPECT_THAT(outcome.err,
              EndsWith("hpsdf: cancelled; 1 of 3 meshes are finished and kept; the same command continues with "
                       "the others\n"));
  EXPECT_THAT(fieldNames(), ElementsAre(nameOf("analytic:sphere") + ".hpsdf"));
  EXPECT_FALSE(fs::exists(recordOf("builtin:gear"))) << "no process has died";
}

/// A batch continues the checkpoint of a killed process and removes that process's unfinished files.
TEST_F(Batches, checkpointIsTakenOver) {
  const std::string shape = "builtin:gear";
  const auto options = [](const char* target) {
    return std::vector<std::string>{"--target-error", target, "--checkpoint", "--checkpoint-seconds", "0"};
  };
  const fs::path state = fieldOf(shape).string() + ".checkpoint";
  const auto kill = [&] {
    Process process(batch(shape, options("1e-6")));
    ASSERT_TRUE(process.sendWhen([&] { return fs::exists(state); }, SIGKILL));
    process.finish();
    ASSERT_TRUE(fs::exists(state));
    ASSERT_FALSE(fs::exists(fieldOf(shape)));
  };
  kill();
  const Outcome other = run(batch(shape, options("1e-3")));
  EXPECT_EQ(other.status, 3);
  EXPECT_THAT(other.err, HasSubstr("is a checkpoint of a build with other options; delete it"));
  const Outcome outcome = run(batch(shape, options("1e-6")));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(".checkpoint, after "));
  EXPECT_TRUE(readFile(fieldOf(shape)) == loneBytes(shape, {"--target-error", "1e-6"}));
  EXPECT_THAT(fieldNames(), ElementsAre(nameOf(shape) + ".hpsdf"));
}

/// Returns the name of the temporary file that a process which has ended leaves behind when it is killed while it
/// writes `file`.
std::string leftover(const fs::path& file) {
  const pid_t child = fork();
  if (child == 0) {
    OutputFile half(file);
    _exit(0);
  }
  waitpid(child, nullptr, 0);
  for (const std::string& name : namesIn(file.parent_path()))
    if (name.starts_with(file.filename().string() + ".part-")) return (file.parent_path() / name).string();
  return "";
}

/// The search for files of killed processes is slow in a folder of many fields, so that it must be rare.
TEST_F(Batches, folderIsSearchedOnlyAfterAProcessDied) {
  const std::string shape = "analytic:box";
  fs::create_directories(fields());
  const std::string half = leftover(fieldOf(shape));
  ASSERT_TRUE(fs::exists(half));
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("built"));
  EXPECT_TRUE(fs::exists(half)) << "nobody has looked";
  writeFile(recordOf(shape), R"({"status": "be)");  // it was killed in the middle of this
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("built"));
  EXPECT_FALSE(fs::exists(half));
  EXPECT_EQ(Json::parse(readFile(recordOf(shape))).at("status"), "built");
}

/// A mesh that ends every process, for want of memory for instance, must not keep the others from being built.
TEST_F(Batches, meshesAtWhichAProcessDiedComeLast) {
  const std::string list = "builtin:gear\nanalytic:box\nanalytic:sphere\n";
  Process process(batch(list, {"--target-error", "1e-8"}));
  const fs::path record = recordOf("builtin:gear");
  const auto isWritten = [&] { return fs::exists(record) && Json::accept(readFile(record)); };
  ASSERT_TRUE(process.sendWhen(isWritten, SIGKILL));
  EXPECT_EQ(process.finish().status, -SIGKILL);
  EXPECT_EQ(Json::parse(readFile(record)).at("status"), "begun");
  std::vector<std::string> order;
  for (const Json& line : linesOf(run(batch(list, kCoarse)))) order.push_back(line.at("file"));
  EXPECT_THAT(order, ElementsAre("analytic:box", "analytic:sphere", "builtin:gear"));
}

/// A checkpoint of a killed process neither stays forever nor stops a later construction.
TEST_F(Batches, checkpointIsRemovedWithTheFieldFinished) {
  const std::string shape = "analytic:box";
  const fs::path state = fieldOf(shape).string() + ".checkpoint";
  fs::create_directory(fields());
  for (const char* status : {"built", "skipped"}) {
    writeFile(state, "of other options\n");
    EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre(status));
    EXPECT_FALSE(fs::exists(state)) << status;
  }
}

/// Four processes build one part each. One of them is killed at some moment, and its part is built again.
TEST_F(Batches, partsAndAKilledProcessGiveTheFieldsOfALoop) {
  constexpr int kShapes = 20, kParts = 4;
  const std::vector<std::string> options = {"--target-error", "1e-4", "--grid", "3", "--threads", "1"};
  std::vector<std::string> shapes;
  for (int i = 0; i < kShapes; ++i)
    shapes.push_back(i % 2 == 0 ? fmt::format("builtin:box,width={}", 1 + 0.03 * i)
                                : fmt::format("builtin:gear,teeth={},segments=1", 4 + i / 2));
  std::string list;
  for (const std::string& shape : shapes) list += shape + "\n";
  const auto part = [&](int number) {
    std::vector<std::string> all = options;
    all.insert(all.end(), {"--part", fmt::format("{}/{}", number, kParts)});
    return batch(list, all);
  };
  std::vector<std::unique_ptr<Process>> processes;
  for (int number = 1; number <= kParts; ++number) processes.push_back(std::make_unique<Process>(part(number)));
  processes[0]->waitForLines(1);
  processes[0]->send(SIGKILL);
  EXPECT_EQ(processes[0]->finish().status, -SIGKILL);
  for (int number = 2; number <= kParts; ++number) {
    const Outcome outcome = processes[std::size_t(number) - 1]->finish();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(statusesOf(outcome), AllOf(SizeIs(kShapes / kParts), Each("built")));
  }
  const std::vector<std::string> again = statusesOf(run(part(1)));
  EXPECT_THAT(again, SizeIs(kShapes / kParts));
  EXPECT_EQ(again.front(), "skipped") << "it was built before the kill";
  EXPECT_THAT(fieldNames(), SizeIs(kShapes)) << "and nothing half-written";
  for (const std::string& shape : shapes) {
    std::vector<std::string> words = {"build", shape, "-o", at("lone.hpsdf")};
    words.insert(words.end(), options.begin(), options.end());
    ASSERT_EQ(runHere(words).status, 0);
    EXPECT_TRUE(readFile(fieldOf(shape)) == readFile(folder_ / "lone.hpsdf")) << shape;
  }
}

TEST_F(Batches, scriptRunsForEachFieldAndWhereItsFilesAreMissing) {
  const std::string list = "analytic:box\nbuiltin:torus\n";
  writeFile(folder_ / "then.hps", "contour output=$name.ply\nsave output=$name.copy.hpsdf\nexpect stats.leaves > 1\n");
  const Call call = batch(list, coarseAnd({"--then", "then.hps"}));
  const Outcome first = run(call);
  EXPECT_EQ(first.status, 0) << first.err;
  EXPECT_THAT(statusesOf(first), ElementsAre("built", "built"));
  const auto besides = [&](const std::string& surface, const char* ending) {
    return fields() / (nameOf(surface) + ending);
  };
  for (const char* surface : {"analytic:box", "builtin:torus"}) {
    EXPECT_TRUE(fs::exists(besides(surface, ".ply"))) << surface;
    EXPECT_TRUE(readFile(besides(surface, ".copy.hpsdf")) == readFile(fieldOf(surface))) << surface;
  }
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("skipped", "skipped"));
  // A missing file is written again, and the field is not built for it.
  const auto built = fs::last_write_time(fieldOf("analytic:box"));
  fs::remove(besides("analytic:box", ".ply"));
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built", "skipped"));
  EXPECT_TRUE(fs::exists(besides("analytic:box", ".ply")));
  EXPECT_EQ(fs::last_write_time(fieldOf("analytic:box")), built);
  // So is everything that another script writes.
  writeFile(folder_ / "then.hps", "contour output=$name.stl\n");
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built", "built"));
  EXPECT_TRUE(fs::exists(besides("builtin:torus", ".stl")));
  EXPECT_EQ(fs::last_write_time(fieldOf("analytic:box")), built);
}

/// The view of the explorer is a part of a session.
TEST_F(Batches, scriptDoesTheSameForAMeshAloneAndAfterAnother) {
  writeFile(folder_ / "then.hps",
            "run inner.hps name=$name\ncamera 40,20,1\nsettings\ncopy-view output=$name.second.txt\n");
  writeFile(folder_ / "inner.hps", "copy-view output=$name.first.txt\n");
  const std::vector<std::string> options = coarseAnd({"--then", "then.hps"});
  const auto viewOf = [&] { return readFile(fields() / (nameOf("builtin:torus") + ".first.txt")); };
  const Outcome after = run(batch("analytic:box\nbuiltin:torus\n", options));
  ASSERT_EQ(after.status, 0) << after.err;
  const std::string view = viewOf();
  fs::remove_all(fields());
  ASSERT_EQ(run(batch("builtin:torus\n", options)).status, 0);
  EXPECT_EQ(viewOf(), view);
}

TEST_F(Batches, scriptThatFailsIsAnErrorOfItsMesh) {
  writeFile(folder_ / "then.hps", "expect stats.leaves < 3000\ncontour output=$name.ply\n");
  const Call call = batch("analytic:box\nbuiltin:gear\n", {"--target-error=1e-5", "--then", "then.hps"});
  const Outcome outcome = run(call);
  EXPECT_EQ(outcome.status, 3);
  ASSERT_THAT(statusesOf(outcome), ElementsAre("failed", "built")) << outcome.err;
  EXPECT_THAT(linesOf(outcome)[0].at("error").get<std::string>(), StartsWith("then.hps:1:1: "));
  EXPECT_FALSE(fs::exists(fields() / (nameOf("analytic:box") + ".ply")));
  const auto built = fs::last_write_time(fieldOf("analytic:box"));
  writeFile(folder_ / "then.hps", "contour output=$name.ply\n");
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built", "built"));
  EXPECT_EQ(fs::last_write_time(fieldOf("analytic:box")), built) << "the field was good";
  writeFile(folder_ / "then.hps", "contuor output=$name.ply\n");
  const Outcome wrong = run(call);
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.err, AllOf(StartsWith("hpsdf: error: then.hps:1:1: "), HasSubstr("did you mean 'contour'?")));
}

TEST_F(Batches, scriptsThatWriteTheFilesOfABatchAreRefused) {
  const auto refused = [&](const char* script, const std::string& message) {
    writeFile(folder_ / "then.hps", script);
    expectRefused(batch("analytic:box\nbuiltin:torus\n", coarseAnd({"--then", "then.hps"})), message);
  };
  refused("contour output=all.ply\n", "then.hps: all.ply would be written for every mesh; begin its name with $name");
  refused("save output=$field\n", ".hpsdf belongs to the batch; give another name");
  refused("query 0,0,0 output=$name.json\n", ".json belongs to the batch; give another name");
}

/// The mesh's name begins as an option does, and its folder is called in two ways.
TEST_F(Batches, namesOfMeshesAndFoldersDoNotMatterToScripts) {
  writeFile(folder_ / "-t.obj", tetrahedron(1));
  writeFile(folder_ / "then.hps", "mesh $mesh\ncontour output=$name.ply\n");
  Call call = batch("-t.obj\n", coarseAnd({"--then", "then.hps"}));
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built"));
  call.words[4] = "./fields/../fields";
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("skipped"));
}

/// A script that is left out leaves nothing to be done for a mesh for which it has failed, or at which a process died.
TEST_F(Batches, recordsOfWholeFieldsSayBuilt) {
  const std::string shape = "analytic:box";
  writeFile(folder_ / "then.hps", "expect stats.leaves < 1\n");
  EXPECT_THAT(statusesOf(run(batch(shape, coarseAnd({"--then", "then.hps"})))), ElementsAre("failed"));
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("skipped"));
  EXPECT_EQ(Json::parse(readFile(recordOf(shape))).at("status"), "built");
  std::string record = readFile(recordOf(shape));
  const std::string built = R"("status": "built")";
  ASSERT_THAT(record, HasSubstr(built));
  writeFile(recordOf(shape), record.replace(record.find(built), built.size(), R"("status": "begun")"));
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("skipped"));
  EXPECT_EQ(Json::parse(readFile(recordOf(shape))).at("status"), "built");
}

/// The mesh is away for a moment.
TEST_F(Batches, failedMeshesKeepTheirFields) {
  writeFile(folder_ / "t.obj", tetrahedron(1));
  const Call call = batch("t.obj\n", kCoarse);
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("built"));
  fs::rename(folder_ / "t.obj", folder_ / "away.obj");
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("failed"));
  fs::rename(folder_ / "away.obj", folder_ / "t.obj");
  EXPECT_THAT(statusesOf(run(call)), ElementsAre("skipped"));
}

TEST_F(Batches, recordsHoldWhatTheLinesHold) {
  writeFile(folder_ / "bad.obj", "this is no mesh\n");
  const Outcome outcome = run(batch("analytic:box\nbad.obj\n", kCoarse));
  for (const Json& line : linesOf(outcome)) {
    Json record = Json::parse(readFile(recordOf(line.at("file"))));
    EXPECT_EQ(record.erase("made_from"), 1u);
    EXPECT_EQ(record.erase("then"), 1u);
    EXPECT_EQ(record, line);
  }
}

TEST_F(Batches, indexListsAllMeshes) {
  writeFile(folder_ / "<bad>.obj", "this is no mesh\n");
  writeFile(folder_ / "then.hps", "contour output=$name.ply\n");
  ASSERT_EQ(run(batch("analytic:box\nbuiltin:torus\n<bad>.obj\n", coarseAnd({"--then", "then.hps"}))).status, 3);
  writeFile(folder_ / "list", "analytic:box\nbuiltin:torus\n<bad>.obj\nanalytic:sphere\n");
  const Outcome outcome = run({.words = {"index", "fields", "--batch", "list"}, .folder = folder_.path()});
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.out, "fields/index.html: 4 meshes, 2 built, 1 failed, 1 missing\n");
  EXPECT_THAT(outcome.err, HasSubstr("fields: 2 of 4 meshes are not built; the page lists them"));
  std::map<std::string, Json> lines;
  std::istringstream text(readFile(fields() / "index.jsonl"));
  for (std::string line; std::getline(text, line);) {
    const Json record = Json::parse(line);
    lines[record.at("file")] = record;
  }
  ASSERT_THAT(lines, SizeIs(4));
  EXPECT_GT(lines.at("builtin:torus").at("leaves"), 1);
  EXPECT_EQ(lines.at("analytic:sphere").at("status"), "missing");
  EXPECT_FALSE(lines.at("analytic:box").contains("made_from"));
  const std::string page = readFile(fields() / "index.html");
  EXPECT_THAT(page, AllOf(HasSubstr("\".ply\""), HasSubstr("\"analytic:sphere\""), HasSubstr("<td>2</td>")));
  EXPECT_THAT(page, AllOf(HasSubstr("\\u003cbad>.obj"), Not(HasSubstr("<bad>")))) << "names end no element";
}

/// The name of the first mesh holds the hash of another, and the field of the second has gone.
TEST_F(Batches, indexFindsTheFilesOfEachMesh) {
  writeFile(folder_ / "scan-0123456789abcdef.v2.obj", tetrahedron(1));
  const std::string scan = "scan-0123456789abcdef.v2.obj", gone = "analytic:box";
  ASSERT_EQ(run(batch(scan + "\n" + gone + "\n", kCoarse)).status, 0);
  writeFile(fields() / (nameOf(scan) + ".a-b.png"), "");
  const std::string half = leftover(fieldOf(scan));
  fs::remove(fieldOf(gone));
  const Outcome outcome = run({.words = {"index", "fields"}, .folder = folder_.path()});
  EXPECT_EQ(outcome.out, "fields/index.html: 2 meshes, 1 built, 1 missing\n");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_THAT(readFile(fields() / "index.html"), HasSubstr(R"([".a-b.png",".hpsdf",".json"])"));
  EXPECT_FALSE(fs::exists(half)) << "what a killed process has left";
}

TEST_F(Batches, indexOfAnotherFolderIsRefused) {
  writeFile(folder_ / "notes-0123456789abcdef.json", "[1, 2]");
  writeFile(folder_ / "package.json", R"({"status": "built"})");
  const Outcome outcome = run({.words = {"index", "."}, .folder = folder_.path()});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr(".: holds no field of a batch; name the folder of 'build --batch'"));
  EXPECT_THAT(run({.words = {"index", "none"}, .folder = folder_.path()}).err, HasSubstr("none: cannot be read ("));
  EXPECT_FALSE(fs::exists(folder_ / "index.html"));
}

}  // namespace batch_test
}  // namespace hpsdf::app
