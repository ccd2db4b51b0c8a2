// Tests the separate process that reads untrusted mesh files: its replies, its limits and its end.
#include "construction/mesh_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "construction/mesh_reply.h"
#include "hpsdf/error.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace mesh_process_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Bytes = std::vector<std::byte>;
using Clock = std::chrono::steady_clock;

// ---------------------------------------------------------------------------------------------------------------------
// Replies

ReplySink into(Bytes& bytes) {
  return [&bytes](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); };
}

Bytes replyOf(const ImportedMesh& imported) {
  Bytes bytes;
  writeMesh(imported, into(bytes));
  return bytes;
}

Bytes refusalOf(std::string_view reason) {
  Bytes bytes;
  writeRefusal(reason, into(bytes));
  return bytes;
}

/// Returns a tetrahedron and a report whose numbers are all different, so that exchanged fields are noticed.
ImportedMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {{5, 6, 7}, {6, 6, 7}, {5, 8, 7}, {5, 6, -0.0}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return {std::move(mesh),
          {.vertices = 4,
           .faces = 4,
           .components = 1,
           .boundaryEdges = 2,
           .nonManifoldEdges = 3,
           .inconsistentEdges = 5,
           .unbalancedEdges = 11,
           .weldedVertices = 6,
           .unreferencedVertices = 7,
           .degenerateFaces = 8,
           .flippedFaces = 9,
           .duplicateFaces = 10,
           .degeneratePosition = {12, 13, 14},
           .duplicatePosition = {15, 16, 17},
           .reversed = true,
           .volume = 2.5,
           .area = 12.5,
           .box = Box(Vector3(5, 6, 0), Vector3(6, 8, 7))}};
}

std::string damageOf(std::span<const std::byte> bytes) {
  try {
    parseReply(bytes);
  } catch (const DamagedReply& damage) {
    return damage.what();
  }
  return "none";
}

std::string damageOf(const ImportedMesh& imported) { return damageOf(replyOf(imported)); }

TEST(MeshReplies, bringAMeshAndAllOfItsReport) {
  const ImportedMesh sent = tetrahedron();
  const Bytes bytes = replyOf(sent);
  EXPECT_EQ(replyBytes(bytes), bytes.size());
  EXPECT_EQ(replyBytes(std::span(bytes).first(kReplyHeaderBytes)), bytes.size());
  const MeshReply reply = parseReply(bytes);
  EXPECT_EQ(reply.kind, MeshReply::Kind::mesh);
  const auto& [mesh, report] = reply.imported;
  EXPECT_EQ(mesh.vertices, sent.mesh.vertices);
  EXPECT_TRUE(std::signbit(mesh.vertices[3].z()));
  EXPECT_EQ(mesh.triangles, sent.mesh.triangles);
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.faces, 4u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.boundaryEdges, 2u);
  EXPECT_EQ(report.nonManifoldEdges, 3u);
  EXPECT_EQ(report.inconsistentEdges, 5u);
  EXPECT_EQ(report.unbalancedEdges, 11u);
  EXPECT_EQ(report.degeneratePosition, Vector3(12, 13, 14));
  EXPECT_EQ(report.duplicatePosition, Vector3(15, 16, 17));
  EXPECT_EQ(report.weldedVertices, 6u);
  EXPECT_EQ(report.unreferencedVertices, 7u);
  EXPECT_EQ(report.degenerateFaces, 8u);
  EXPECT_EQ(report.flippedFaces, 9u);
  EXPECT_EQ(report.duplicateFaces, 10u);
  EXPECT_TRUE(report.reversed);
  EXPECT_EQ(report.volume, 2.5);
  EXPECT_EQ(report.area, 12.5);
  EXPECT_EQ(report.box.min(), sent.report.box.min());
  EXPECT_EQ(report.box.max(), sent.report.box.max());
}

TEST(MeshReplies, bringReasonsInOneLine) {
  const MeshReply refusal = parseReply(refusalOf("t.off: no\nmesh \x1b[2J"));
  EXPECT_EQ(refusal.kind, MeshReply::Kind::refusal);
  EXPECT_EQ(refusal.refusal, "t.off: no mesh  [2J");
  EXPECT_EQ(parseReply(refusalOf("t.off: \xc2\x9b"
                                 "2J \xc2\x80 \xc2\x9f \xc2\xa0 \xc3\x9b"))
                .refusal,
            "t.off:  2J     \xc2\xa0 \xc3\x9b")
      << "the control characters behind the first 128";
  EXPECT_EQ(parseReply(refusalOf(std::string(1'000'000, 'x'))).refusal, std::string(65536, 'x'));
  Bytes none;
  writeOutOfMemory(into(none));
  EXPECT_EQ(parseReply(none).kind, MeshReply::Kind::outOfMemory);
}

TEST(MeshReplies, areRefusedWhenCutShortOrLong) {
  for (Bytes bytes : {replyOf(tetrahedron()), refusalOf("t.off: no mesh")}) {
    for (std::size_t length = 0; length < bytes.size(); ++length)
      EXPECT_EQ(damageOf(std::span(bytes).first(length)), "it ends too early") << length;
    bytes.emplace_back();
    EXPECT_EQ(damageOf(bytes), "it goes on too long");
  }
}

TEST(MeshReplies, areRefusedWithAnyBitFlipped) {
  for (Bytes bytes : {replyOf(tetrahedron()), refusalOf("t.off: no mesh")})
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      bytes[bit / 8] ^= std::byte(1 << bit % 8);
      EXPECT_NE(damageOf(bytes), "none") << "bit " << bit;
      bytes[bit / 8] ^= std::byte(1 << bit % 8);
    }
}

TEST(MeshReplies, areNotBelievedForTheirChecksum) {
  const auto with = [](const auto& change) {
    ImportedMesh imported = tetrahedron();
    change(imported);
    return damageOf(imported);
  };
  EXPECT_EQ(with([](ImportedMesh&) {}), "none");
  EXPECT_EQ(with([](ImportedMesh& i) { i.mesh.triangles[3][1] = 4; }), "an index is out of range");
  EXPECT_EQ(with([](ImportedMesh& i) { i.mesh.triangles[0][0] = 0xffffffff; }), "an index is out of range");
  EXPECT_EQ(with([](ImportedMesh& i) { i.mesh.vertices.clear(); }), "an index is out of range");
  EXPECT_EQ(with([](ImportedMesh& i) { i.mesh.triangles.clear(); }), "its counts do not fit its kind");
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1.1e100}) {
    EXPECT_THAT(with([&](ImportedMesh& i) { i.mesh.vertices[2].y() = bad; }), StartsWith("a coordinate is not finite"));
    if (!std::isfinite(bad)) {
      EXPECT_EQ(with([&](ImportedMesh& i) { i.report.volume = bad; }), "a figure is not finite");
      EXPECT_EQ(with([&](ImportedMesh& i) { i.report.area = bad; }), "a figure is not finite");
    }
  }
}

TEST(MeshReplies, bringTextWithRefusalsAlone) {
  Bytes bytes = refusalOf("t.off: no mesh");
  const auto outOfMemory = std::uint64_t(MeshReply::Kind::outOfMemory);
  std::memcpy(bytes.data() + 16, &outOfMemory, 8);  // writes the kind, which follows the magic number and the checksum
  EXPECT_EQ(damageOf(bytes), "its counts do not fit its kind");
}

/// The counts of vertices and triangles follow the magic number, the checksum and the kind of the reply.
TEST(MeshReplies, takeNoMemoryForWhatTheyPromise) {
  const auto promising = [](std::uint64_t vertices, std::uint64_t triangles) {
    Bytes bytes = replyOf(tetrahedron());
    std::memcpy(bytes.data() + 24, &vertices, 8);
    std::memcpy(bytes.data() + 32, &triangles, 8);
    return bytes;
  };
  EXPECT_EQ(damageOf(promising(4, 4)), "none");
  EXPECT_EQ(damageOf(promising(std::uint64_t{1} << 32, std::uint64_t{1} << 40)), "it ends too early");
  EXPECT_EQ(damageOf(promising((std::uint64_t{1} << 32) + 1, 4)), "its counts are too large");
  EXPECT_EQ(damageOf(promising(4, (std::uint64_t{1} << 40) + 1)), "its counts are too large");
  EXPECT_EQ(damageOf(promising(~std::uint64_t{0}, ~std::uint64_t{0})), "its counts are too large");
}

// ---------------------------------------------------------------------------------------------------------------------
// Processes

constexpr ReadingLimits kPlenty = {.seconds = 60, .bytes = std::uint64_t{1} << 30};

class MeshProcess : public testing::Test {
 protected:
  fs::path write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  /// Writes a shell script that is started instead of the program that reads meshes.
  fs::path script(const std::string& lines) const {
    const fs::path file = write("reader", "#!/bin/sh\n" + lines + "\n");
    fs::permissions(file, fs::perms::owner_all);
    return file;
  }

  /// Returns the message of the error with which reading fails; empty if the mesh is read.
  static std::string errorOf(const fs::path& file, const ReadingLimits& limits = kPlenty,
                             const fs::path& program = HPSDF_PROGRAM) {
    try {
      importInSubprocess(program, file, limits, {});
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), AllOf(StartsWith(file.string() + ": "), Not(HasSubstr("\n"))));
      expectNoChild();
      return error.what();
    }
    expectNoChild();
    return "";
  }

  static void expectNoChild() {
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }

  support::TemporaryDirectory folder_;
};

constexpr std::string_view kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
constexpr std::string_view kOff = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

/// Returns a polygon with its corners back and forth on a line: triangulating it takes quadratic time.
std::string polygon(int corners) {
  std::ostringstream file;
  for (int i = 0; i < corners; ++i) file << "v " << (i % 2 == 0 ? corners - i : i) << " 0 0\n";
  file << "f";
  for (int i = 1; i <= corners; ++i) file << " " << i;
  file << "\n";
  return file.str();
}

TEST_F(MeshProcess, readsWhatThisProcessWouldRead) {
  for (const fs::path& file : {write("t.obj", kObj), write("t.off", kOff)}) {
    const ImportedMesh here = importMesh(file);
    const ImportedMesh apart = importInSubprocess(HPSDF_PROGRAM, file, kPlenty, {});
    EXPECT_EQ(apart.mesh.vertices, here.mesh.vertices);
    EXPECT_EQ(apart.mesh.triangles, here.mesh.triangles);
    EXPECT_EQ(apart.mesh.name, here.mesh.name);
    EXPECT_TRUE(apart.report.closed());
    EXPECT_EQ(apart.report.volume, here.report.volume);
    EXPECT_EQ(apart.report.area, here.report.area);
    EXPECT_EQ(apart.report.box.max(), here.report.box.max());
    expectNoChild();
  }
}

TEST_F(MeshProcess, refusesInTheSameWords) {
  for (const fs::path& file : {folder_ / "missing.obj", write("empty.ply", ""), write("t.xyz", kObj),
                               write("t.obj", "v 0 0 0\n"), write("t.glb", "glTF and no more")}) {
    std::string here;
    try {
      importMesh(file);
    } catch (const Error& error) {
      here = error.what();
    }
    EXPECT_NE(here, "");
    EXPECT_EQ(errorOf(file), here);
  }
}

TEST_F(MeshProcess, outlivesWhatBringsAssimpDown) {
  // assimp's JSON reader recurses at each bracket until its stack overflows.
  EXPECT_THAT(errorOf(write("t.gltf", std::string(200'000, '['))), HasSubstr("came down ("));
}

TEST_F(MeshProcess, endsInTime) {
  const fs::path file = write("t.obj", polygon(100'000));
  const auto start = Clock::now();
  EXPECT_THAT(errorOf(file, {.seconds = 0.5, .bytes = kPlenty.bytes}),
              AllOf(HasSubstr("takes more than 0.5 s"), HasSubstr("HPSDF_IMPORT_SECONDS")));
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
}

TEST_F(MeshProcess, keepsItsMemory) {
#ifdef HPSDF_SANITIZED
  GTEST_SKIP() << "sanitizers take terabytes of addresses: no limit is set";
#endif
  std::string file(kObj);
  for (int i = 0; i < 300'000; ++i) file += "v 0 0 0\n";
  EXPECT_EQ(errorOf(write("t.obj", file), kPlenty), "");
  EXPECT_THAT(errorOf(write("t.obj", file), {.seconds = 60, .bytes = 20'000'000}),
              AllOf(HasSubstr("takes more than 20"), HasSubstr("HPSDF_IMPORT_BYTES")));
}

/// The limit is exceeded in allocations of assimp as well as in allocations of Eigen.
TEST_F(MeshProcess, keepsAnyLimitOfMemory) {
#ifdef HPSDF_SANITIZED
  GTEST_SKIP() << "sanitizers take terabytes of addresses: no limit is set";
#endif
  std::ostringstream file;
  for (int i = 0; i < 3000; ++i)
    file << "v " << i << " 0 0\nv " << i << " 1 0\nv " << i << " 0 " << i + 1 << "\nf -3 -2 -1\n";
  const fs::path mesh = write("t.obj", file.str());
  bool isRead = false;
  for (std::uint64_t bytes = 1; !isRead; bytes += 800'000) {
    const std::string error = errorOf(mesh, {.seconds = 60, .bytes = bytes});
    isRead = error.empty();
    if (!isRead) {
      EXPECT_THAT(error, AllOf(HasSubstr("takes more than"), HasSubstr("HPSDF_IMPORT_BYTES"))) << bytes;
    }
  }
}

TEST_F(MeshProcess, allowsMoreForLargeFilesAndWhatIsAskedFor) {
  const fs::path small = write("small.obj", kObj);
  const fs::path large = write("large.obj", "v");
  fs::resize_file(large, 200'000'000);
  EXPECT_EQ(readingLimits(small).seconds, 60);
  EXPECT_EQ(readingLimits(small).bytes, (std::uint64_t{1} << 30) + 32 * kObj.size());
  EXPECT_EQ(readingLimits(large).seconds, 160);
  EXPECT_EQ(readingLimits(large).bytes, (std::uint64_t{1} << 30) + 32ull * 200'000'000);
  setenv("HPSDF_IMPORT_SECONDS", "2.5", 1);
  setenv("HPSDF_IMPORT_BYTES", "3e9", 1);
  EXPECT_EQ(readingLimits(large).seconds, 2.5);
  EXPECT_EQ(readingLimits(large).bytes, 3'000'000'000u);
  setenv("HPSDF_IMPORT_SECONDS", "soon", 1);
  EXPECT_THROW(readingLimits(small), Error);
  setenv("HPSDF_IMPORT_SECONDS", "0", 1);
  EXPECT_THROW(readingLimits(small), Error);
  unsetenv("HPSDF_IMPORT_SECONDS");
  unsetenv("HPSDF_IMPORT_BYTES");
}

TEST_F(MeshProcess, isCancelled) {
  const fs::path file = write("\x1b[2Jt.obj", polygon(100'000));
  const auto start = Clock::now();
  std::vector<std::string> tasks;
  const Progress progress{
      .report = [&](std::string_view task, double) { tasks.emplace_back(task); },
      .cancelled = [&] { return Clock::now() - start > std::chrono::milliseconds(2500); },
  };
  EXPECT_THROW(importInSubprocess(HPSDF_PROGRAM, file, kPlenty, progress), Cancelled);
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
  ASSERT_FALSE(tasks.empty());
  EXPECT_EQ(tasks[0], "Reading  [2Jt.obj");
  expectNoChild();
}

/// Shell scripts stand in for a reader process that a malicious mesh file has taken over.
TEST_F(MeshProcess, believesNoAnswer) {
  const fs::path file = write("t.obj", kObj);
  const auto answer = [&](const std::string& lines, double seconds = 60) {
    return errorOf(file, {.seconds = seconds, .bytes = kPlenty.bytes}, script(lines));
  };
  EXPECT_THAT(answer("exit 0"), HasSubstr("came down (exit status 0)"));
  EXPECT_THAT(answer("exit 7"), HasSubstr("came down (exit status 7)"));
  EXPECT_THAT(answer("echo hello"), HasSubstr("came down (exit status 0)"));
  EXPECT_THAT(answer("kill -KILL $$"), HasSubstr("came down (killed"));
  EXPECT_THAT(answer("kill -ABRT $$"), HasSubstr("came down (aborted by a check of its own)"));
  EXPECT_THAT(answer("kill -SEGV $$"), HasSubstr("came down (wrong access to memory)"));
  EXPECT_THAT(answer("cat /dev/zero"), HasSubstr("wrong answer (it does not begin like one)"));
  EXPECT_THAT(answer("exec sleep 100", 0.2), HasSubstr("takes more than 0.2 s"));
  EXPECT_THAT(answer("exec >&-; exec sleep 100", 0.2), HasSubstr("takes more than 0.2 s"));
  EXPECT_THAT(errorOf(file, kPlenty, folder_ / "none"), HasSubstr("no process can be started"));

  const Bytes reply = replyOf(tetrahedron());
  write("reply", {reinterpret_cast<const char*>(reply.data()), reply.size()});
  const std::string send = "cat '" + (folder_ / "reply").string() + "'";
  EXPECT_EQ(answer(send), "");
  EXPECT_EQ(answer(send + "; exit 3"), "") << "the answer was whole";
  EXPECT_THAT(answer(send + " /dev/zero"), HasSubstr("wrong answer (it goes on too long)"));
  EXPECT_THAT(answer("head -c 200 '" + (folder_ / "reply").string() + "'"), HasSubstr("came down"));
  EXPECT_THAT(errorOf(file, {.seconds = 60, .bytes = reply.size() - 1}, script(send)),
              AllOf(HasSubstr("takes more than"), HasSubstr("HPSDF_IMPORT_BYTES")));
}

// ---------------------------------------------------------------------------------------------------------------------
// Mutations

struct Original {
  std::string extension;
  std::string content;
};

template <typename T>
void append(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

constexpr float kCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr std::uint16_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

std::string plyHeader(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
         "property list uchar int vertex_indices\nend_header\n";
}

std::string binaryPly() {
  std::string file = plyHeader("binary_little_endian");
  for (const auto& corner : kCorners)
    for (const float x : corner) append(file, x);
  for (const auto& face : kFaces) {
    append(file, std::uint8_t{3});
    for (const std::uint16_t v : face) append(file, std::int32_t{v});
  }
  return file;
}

std::string binaryStl() {
  std::string file(80, ' ');
  append(file, std::uint32_t{4});
  for (const auto& face : kFaces) {
    for (int i = 0; i < 3; ++i) append(file, 0.0F);
    for (const std::uint16_t v : face)
      for (const float x : kCorners[v]) append(file, x);
    append(file, std::uint16_t{0});
  }
  return file;
}

std::string asciiStl() {
  std::ostringstream file;
  file << "solid t\n";
  for (const auto& face : kFaces) {
    file << "facet normal 0 0 0\nouter loop\n";
    for (const std::uint16_t v : face)
      file << "vertex " << kCorners[v][0] << " " << kCorners[v][1] << " " << kCorners[v][2] << "\n";
    file << "endloop\nendfacet\n";
  }
  file << "endsolid t\n";
  return file.str();
}

std::string glb() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":72}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
      R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string data;
  for (const auto& corner : kCorners)
    for (const float x : corner) append(data, x);
  for (const auto& face : kFaces)
    for (const std::uint16_t v : face) append(data, v);
  std::string file = "glTF";
  for (const std::size_t word : {std::size_t{2}, 12 + 8 + json.size() + 8 + data.size(), json.size()})
    append(file, std::uint32_t(word));
  file += "JSON" + json;
  append(file, std::uint32_t(data.size()));
  return file + std::string("BIN\0", 4) + data;
}

std::vector<Original> originals() {
  return {{"off", std::string(kOff)},
          {"obj", std::string(kObj)},
          {"ply", plyHeader("ascii") + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"},
          {"ply", binaryPly()},
          {"stl", asciiStl()},
          {"stl", binaryStl()},
          {"glb", glb()}};
}

/// Makes one to four random changes: flips a bit, or replaces, removes, duplicates, inserts or cuts off bytes.
std::string mutated(std::string file, std::mt19937& random) {
  const auto below = [&](std::size_t end) { return std::size_t(random() % end); };
  constexpr std::string_view kOdd = "0123456789-.e \n#/,{}[]\"\xff";
  for (std::size_t change = 1 + below(4); change > 0 && !file.empty(); --change) {
    const std::size_t at = below(file.size());
    switch (below(6)) {
      case 0:
        file[at] = char(file[at] ^ (1 << below(8)));
        break;
      case 1:
        file[at] = kOdd[below(kOdd.size())];
        break;
      case 2:
        file.erase(at, 1 + below(8));
        break;
      case 3:
        file.insert(at, file.substr(at, 1 + below(16)));
        break;
      case 4:
        file.insert(at, 1, kOdd[below(kOdd.size())]);
        break;
      default:
        if (below(4) == 0) file.resize(at);
    }
  }
  return file;
}

/// The environment variables HPSDF_MUTATIONS and HPSDF_MUTATION_SEED set the number of files and the random seed.
TEST_F(MeshProcess, mutatedFilesAreMeshesOrErrorsOfOneLine) {
  const auto asked = [](const char* name, std::size_t otherwise) {
    const char* text = std::getenv(name);
    return text == nullptr ? otherwise : std::size_t(std::strtoull(text, nullptr, 10));
  };
  const std::size_t count = asked("HPSDF_MUTATIONS", 280);
  std::mt19937 random(unsigned(asked("HPSDF_MUTATION_SEED", 1)));
  const std::vector<Original> files = originals();
  for (const Original& file : files)
    EXPECT_EQ(errorOf(write("t." + file.extension, file.content)), "") << file.extension;

  std::map<std::string, std::size_t> outcomes;
  double slowest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Original& original = files[i % files.size()];
    const fs::path file = write("t." + original.extension, mutated(original.content, random));
    const auto start = Clock::now();
    const std::string error = errorOf(file, {.seconds = 10, .bytes = kPlenty.bytes});
    slowest = std::max(slowest, std::chrono::duration<double>(Clock::now() - start).count());
    const std::size_t died = error.find("came down");
    ++outcomes[error.empty()                                   ? "mesh"
               : died != std::string::npos                     ? error.substr(died, error.find(':', died) - died)
               : error.find("takes more") != std::string::npos ? "limit"
                                                               : "refused"];
  }
  for (const auto& [outcome, times] : outcomes) std::printf("%6zu %s\n", times, outcome.c_str());
  std::printf("slowest: %.3f s\n", slowest);
  EXPECT_GT(outcomes["mesh"], count / 20);
  EXPECT_GT(outcomes["refused"], count / 20);
}

}  // namespace mesh_process_test
}  // namespace hpsdf::app
