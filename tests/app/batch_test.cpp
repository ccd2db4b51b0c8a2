// Tests batches of meshes, built by one process, by several processes, and by processes that are killed.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
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

  /// Returns the names of the field files, without the folder in which the batch keeps its own records.
  std::set<std::string> fieldNames() const {
    std::set<std::string> names = namesIn(fields());
    EXPECT_EQ(names.erase(".batch"), 1u);
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
  EXPECT_THAT(written, SizeIs(8)) << "fields, what they are made of, the folder of that, the claims";
  const std::string before = readFile(fieldOf("t.obj"));
  const Outcome again = run(call);
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(statusesOf(again), ElementsAre("skipped", "skipped", "skipped"));
  EXPECT_EQ(linesOf(again)[0].at("leaves"), statistics(load(fieldOf("t.obj"))).leaves);
  EXPECT_THAT(again.err, HasSubstr("0 built, 3 skipped, 0 built elsewhere, 0 failed"));
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
  fs::remove(fields() / ".batch" / (nameOf("builtin:box") + ".json"));
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
  // A folder replaces the file that marks an unfinished construction; it can be neither removed nor overwritten.
  const fs::path mark = fields() / ".batch" / (nameOf("analytic:box") + ".begun");
  fs::create_directories(mark / "full");
  EXPECT_EQ(errorOf("analytic:box"), "fields/.batch/" + mark.filename().string() +
                                         ": Directory not empty; check that it is there, and its permissions");
  fs::remove_all(mark);
  fs::create_symlink("none/mark", mark);
  EXPECT_EQ(errorOf("analytic:box"), "fields/.batch/" + mark.filename().string() +
                                         ": cannot be written (No such file or directory); check the folder's "
                                         "permissions");
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
}

/// Returns true if a process holds the file lock of any mesh in this output folder.
bool isAtWork(const fs::path& fields) {
  const int file = open((fields / ".batch" / "claims").c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return false;
  struct flock range = {};
  range.l_type = F_WRLCK;
  range.l_whence = SEEK_SET;
  fcntl(file, F_GETLK, &range);
  close(file);
  return range.l_type != F_UNLCK;
}

/// The first process holds the lock of a mesh and is stopped by a signal; the second process waits for that mesh.
class TwoProcesses : public Batches {
 protected:
  /// Options with which the construction takes some tenths of a second.
  const std::vector<std::string> kOptions = {"--target-error", "1e-6"};
  const std::string kShape = "builtin:gear";

  void SetUp() override {
    first_ = std::make_unique<Process>(batch(kShape, kOptions));
    ASSERT_TRUE(first_->sendWhen([this] { return isAtWork(fields()); }, SIGSTOP));
    second_ = std::make_unique<Process>(batch(kShape, kOptions));
    ASSERT_TRUE(second_->waitForError("waiting for 1 of 1 meshes"));
    ASSERT_FALSE(second_->hasEnded());
  }

  std::unique_ptr<Process> first_, second_;
};

TEST_F(TwoProcesses, survivorTakesOverFromAKilledProcess) {
  first_->send(SIGKILL);
  const Outcome outcome = second_->finish();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(statusesOf(outcome), ElementsAre("built"));
  EXPECT_EQ(first_->finish().status, -SIGKILL);
  EXPECT_TRUE(readFile(fieldOf(kShape)) == loneBytes(kShape, kOptions));
}

TEST_F(TwoProcesses, oneWaitsForTheOther) {
  first_->send(SIGCONT);
  const Outcome outcome = second_->finish();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(statusesOf(outcome), ElementsAre("elsewhere"));
  EXPECT_THAT(statusesOf(first_->finish()), ElementsAre("built"));
  EXPECT_TRUE(fs::exists(fieldOf(kShape)));
}

/// The first process is stopped by a signal during its construction, and its lock file is deleted.
class LostLocks : public Batches {
 protected:
  /// Options with which the construction takes some tenths of a second.
  const std::vector<std::string> kOptions = {"--target-error", "1e-6"};
  const std::string kShape = "builtin:gear";

  void SetUp() override {
    process_ = std::make_unique<Process>(batch(kShape, kOptions));
    const fs::path mark = fields() / ".batch" / (nameOf(kShape) + ".begun");
    ASSERT_TRUE(process_->sendWhen([&] { return fs::exists(mark); }, SIGSTOP));
    fs::remove(fields() / ".batch" / "claims");
  }

  /// Lets the stopped process continue, and expects that it reports `status` and that the field is complete.
  void expectGoesOn(const char* status) {
    process_->send(SIGCONT);
    const Outcome outcome = process_->finish();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(statusesOf(outcome), ElementsAre(status));
    EXPECT_TRUE(readFile(fieldOf(kShape)) == loneBytes(kShape, kOptions));
  }

  std::unique_ptr<Process> process_;
};

TEST_F(LostLocks, fieldOfTheOtherProcessIsAccepted) {
  EXPECT_THAT(statusesOf(run(batch(kShape, kOptions))), ElementsAre("built"));
  const rlimit none = {16, 16};  // limits the size of files to 16 bytes, so that writing a field fails
  ASSERT_EQ(prlimit(process_->id(), RLIMIT_FSIZE, &none, nullptr), 0);
  expectGoesOn("elsewhere");
}

TEST_F(LostLocks, removedFilesAreWrittenAgain) {
  // Temporary file 0 checks that the folder is writable. The next 100 names are taken, so that the first attempt to
  // write the field fails.
  for (int n = 1; n <= 100; ++n)
    writeFile(fmt::format("{}.part-{}-{}", fieldOf(kShape).string(), process_->id(), n), "");
  expectGoesOn("built");
}

TEST_F(TwoProcesses, waitingProcessCanBeInterrupted) {
  second_->send(SIGINT);
  const Outcome outcome = second_->finish();
  EXPECT_EQ(outcome.status, 130);
  EXPECT_THAT(outcome.err,
              EndsWith("hpsdf: cancelled; 0 of 1 meshes are finished and kept; the same command continues with "
                       "the others\n"));
  EXPECT_THAT(outcome.out, IsEmpty());
  first_->send(SIGKILL);
  first_->finish();
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
  // Process 1 runs here, but these files are from process 1 of another machine: nobody is building the mesh.
  for (const fs::path& file : {fieldOf(shape), state}) writeFile(file.string() + ".part-1-0", "half a fie");
  const Outcome other = run(batch(shape, options("1e-3")));
  EXPECT_EQ(other.status, 3);
  EXPECT_THAT(other.err, HasSubstr("is a checkpoint of a build with other options; delete it"));
  const Outcome outcome = run(batch(shape, options("1e-6")));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(".checkpoint, after "));
  EXPECT_TRUE(readFile(fieldOf(shape)) == loneBytes(shape, {"--target-error", "1e-6"}));
  EXPECT_THAT(fieldNames(), ElementsAre(nameOf(shape) + ".hpsdf"));
}

/// The search for files of killed processes is slow in a folder of many fields, so that it must be rare.
TEST_F(Batches, folderIsSearchedOnlyAfterAProcessDied) {
  const std::string shape = "analytic:box";
  const fs::path mark = fields() / ".batch" / (nameOf(shape) + ".begun"), half = fieldOf(shape).string() + ".part-1-0";
  fs::create_directories(mark.parent_path());
  writeFile(half, "half a fie");
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("built"));
  EXPECT_TRUE(fs::exists(half)) << "nobody has looked";
  EXPECT_FALSE(fs::exists(mark));
  writeFile(mark, "");
  EXPECT_THAT(statusesOf(run(batch(shape, kCoarse))), ElementsAre("skipped"));
  EXPECT_FALSE(fs::exists(half));
  EXPECT_FALSE(fs::exists(mark));
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

TEST_F(Batches, fourProcessesAndOneKilledBuildEachFieldOnce) {
  constexpr int kShapes = 40;
  const std::vector<std::string> options = {"--target-error", "1e-4", "--grid", "3", "--threads", "1"};
  std::vector<std::string> shapes;
  for (int i = 0; i < kShapes; ++i)
    shapes.push_back(i % 2 == 0 ? fmt::format("builtin:box,width={}", 1 + 0.03 * i)
                                : fmt::format("builtin:gear,teeth={},segments=1", 4 + i / 2));
  std::string list;
  for (const std::string& shape : shapes) list += shape + "\n";
  const Call call = batch(list, options);

  std::vector<std::unique_ptr<Process>> processes;
  processes.push_back(std::make_unique<Process>(call));
  processes[0]->waitForLines(1);  // the first process has built this field before the other processes start
  for (int i = 1; i < 4; ++i) processes.push_back(std::make_unique<Process>(call));
  processes[0]->waitForLines(2);
  processes[0]->send(SIGKILL);
  std::map<std::string, int> timesBuilt;
  int builtByVictim = 0;
  for (const auto& process : processes) {
    const bool killed = process == processes[0];
    const Outcome outcome = process->finish();
    EXPECT_EQ(outcome.status, killed ? -SIGKILL : 0) << outcome.err;
    const std::vector<Json> lines = linesOf(outcome);
    EXPECT_TRUE(killed ? lines.size() < kShapes : lines.size() == kShapes) << lines.size();
    for (const Json& line : lines) {
      EXPECT_NE(line.at("status"), "failed") << line;
      if (line.at("status") != "built") continue;
      ++timesBuilt[line.at("file")];
      if (killed) ++builtByVictim;
    }
  }
  EXPECT_GE(builtByVictim, 1) << "it was in the middle of its work";
  // One field may be missing in the reports: a process may be killed after writing it and before reporting it.
  EXPECT_GE(timesBuilt.size(), std::size_t{kShapes - 1});
  for (const auto& [shape, times] : timesBuilt) EXPECT_EQ(times, 1) << shape;
  EXPECT_THAT(fieldNames(), SizeIs(kShapes)) << "and nothing half-written";
  for (const std::string& shape : shapes) {
    std::vector<std::string> words = {"build", shape, "-o", at("lone.hpsdf")};
    words.insert(words.end(), options.begin(), options.end());
    ASSERT_EQ(runHere(words).status, 0);
    EXPECT_NO_THROW(load(fieldOf(shape))) << shape;
    EXPECT_TRUE(readFile(fieldOf(shape)) == readFile(folder_ / "lone.hpsdf")) << shape;
  }
  const std::vector<std::string> statuses = statusesOf(run(call));
  EXPECT_THAT(statuses, AllOf(SizeIs(kShapes), Each("skipped")));
}

}  // namespace batch_test
}  // namespace hpsdf::app
