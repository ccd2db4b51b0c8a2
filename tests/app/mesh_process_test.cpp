// Tests the separate process that reads untrusted mesh files: its answers, its limits and its end.
#include "construction/mesh_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/error.h"
#include "support/assimp_files.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace mesh_process_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Clock = std::chrono::steady_clock;

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

TEST_F(MeshProcess, readsWhatThisProcessWouldRead) {
  for (const fs::path& file :
       {write("t.3ds", support::tetrahedron3ds()), write("t.obj", "v 0 0 0.1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}) {
    const ImportedMesh here = importMesh(file);
    const ImportedMesh apart = importInSubprocess(HPSDF_PROGRAM, file, kPlenty, {});
    EXPECT_EQ(apart.mesh.vertices, here.mesh.vertices);
    EXPECT_EQ(apart.mesh.triangles, here.mesh.triangles);
    EXPECT_EQ(apart.mesh.name, here.mesh.name);
    EXPECT_EQ(apart.report.closed(), here.report.closed());
    EXPECT_EQ(apart.report.area, here.report.area);
    expectNoChild();
  }
}

TEST_F(MeshProcess, refusesInTheSameWords) {
  for (const fs::path& file : {folder_ / "missing.3ds", write("empty.3ds", ""), write("t.xyz", "v 0 0 0\n"),
                               write("t.obj", "v 0 0 0\n"), write("t.3ds", "3DS and no more")}) {
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
  EXPECT_THAT(errorOf(write("t.3ds", support::crashing3ds())), HasSubstr("came down ("));
}

TEST_F(MeshProcess, endsInTime) {
  const fs::path file = write("t.3ds", support::slow3ds());
  const auto start = Clock::now();
  EXPECT_THAT(errorOf(file, {.seconds = 0.5, .bytes = kPlenty.bytes}),
              AllOf(HasSubstr("takes more than 0.5 s"), HasSubstr("HPSDF_IMPORT_SECONDS")));
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
}

/// Memory runs out in allocations of assimp as well as in those of this project, and in the answer.
TEST_F(MeshProcess, keepsAnyLimitOfMemory) {
#ifdef HPSDF_SANITIZED
  GTEST_SKIP() << "sanitizers take terabytes of addresses: no limit is set";
#endif
  const fs::path mesh = write("t.3ds", support::nodes3ds(3000, true));
  bool isRead = false;
  for (std::uint64_t bytes = 1; !isRead; bytes += 800'000) {
    const std::string error = errorOf(mesh, {.seconds = 60, .bytes = bytes});
    isRead = error.find("takes more than") == std::string::npos;
    if (!isRead) {
      EXPECT_THAT(error, HasSubstr("HPSDF_IMPORT_BYTES")) << bytes;
    }
  }
}

TEST_F(MeshProcess, allowsMoreForLargeFilesAndWhatIsAskedFor) {
  const fs::path small = write("small.3ds", "3DS");
  const fs::path large = write("large.3ds", "3DS");
  fs::resize_file(large, 200'000'000);
  EXPECT_EQ(readingLimits(small).seconds, 60);
  EXPECT_EQ(readingLimits(small).bytes, (std::uint64_t{1} << 30) + 32 * 3);
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
  const fs::path file = write("t.3ds", support::slow3ds());
  const auto start = Clock::now();
  std::vector<std::string> tasks;
  const Progress progress{
      .report = [&](std::string_view task, double) { tasks.emplace_back(task); },
      .cancelled = [&] { return Clock::now() - start > std::chrono::milliseconds(2500); },
  };
  EXPECT_THROW(importInSubprocess(HPSDF_PROGRAM, file, kPlenty, progress), Cancelled);
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
  ASSERT_FALSE(tasks.empty());
  EXPECT_EQ(tasks[0], "Reading the mesh");
  expectNoChild();
}

/// Shell scripts stand in for a reader process that a malicious mesh file has taken over.
TEST_F(MeshProcess, believesNoAnswer) {
  const fs::path file = write("t.3ds", support::tetrahedron3ds());
  const auto answer = [&](const std::string& lines, double seconds = 60, std::uint64_t bytes = 1'000'000) {
    return errorOf(file, {.seconds = seconds, .bytes = bytes}, script(lines));
  };
  EXPECT_THAT(answer("exit 0"), HasSubstr("came down (it gave no answer)"));
  EXPECT_THAT(answer("exit 7"), HasSubstr("came down (exit status 7)"));
  EXPECT_THAT(answer("echo hello"), HasSubstr("came down (its answer was no mesh: line 1: a PLY file begins with"));
  EXPECT_THAT(answer("kill -KILL $$"), HasSubstr("came down (killed"));
  EXPECT_THAT(answer("kill -ABRT $$"), HasSubstr("came down (aborted by a check of its own)"));
  EXPECT_THAT(answer("kill -SEGV $$"), HasSubstr("came down (wrong access to memory)"));
  EXPECT_THAT(answer("cat /dev/zero"), AllOf(HasSubstr("takes more than"), HasSubstr("HPSDF_IMPORT_BYTES")));
  EXPECT_THAT(answer("exec sleep 100", 0.2), HasSubstr("takes more than 0.2 s"));
  EXPECT_THAT(answer("exec >&-; exec sleep 100", 0.2), HasSubstr("takes more than 0.2 s"));
  EXPECT_THAT(errorOf(file, kPlenty, folder_ / "none"), HasSubstr("no process can be started"));
  EXPECT_THAT(answer("printf 'refused: no\\nmesh \\033[2J'"), HasSubstr(": no\\nmesh \\x1b[2J"));
  EXPECT_THAT(answer("printf 'out of memory'"), HasSubstr("takes more than 1.00 MB of memory"));

  saveMesh(importMesh(file).mesh, folder_ / "answer.ply");
  const std::string send = "cat '" + (folder_ / "answer.ply").string() + "'";
  EXPECT_EQ(answer(send), "");
  EXPECT_THAT(answer(send + "; exit 3"), HasSubstr("came down (exit status 3)"));
  EXPECT_THAT(answer(send + "; echo more"), HasSubstr("its answer was no mesh: the file goes on"));
  EXPECT_THAT(answer("head -c 270 '" + (folder_ / "answer.ply").string() + "'"),
              HasSubstr("its answer was no mesh: its header promises 4 faces"));
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

/// The environment variables HPSDF_MUTATIONS and HPSDF_MUTATION_SEED set the number of files and the random seed. The
/// fuzz targets mutate files of the other formats.
TEST_F(MeshProcess, mutatedFilesAreMeshesOrErrorsOfOneLine) {
  const auto asked = [](const char* name, std::size_t otherwise) {
    const char* text = std::getenv(name);
    return text == nullptr ? otherwise : std::size_t(std::strtoull(text, nullptr, 10));
  };
  const std::size_t count = asked("HPSDF_MUTATIONS", 100);
  std::mt19937 random(unsigned(asked("HPSDF_MUTATION_SEED", 1)));
  const std::string original = support::tetrahedron3ds();
  EXPECT_EQ(errorOf(write("t.3ds", original)), "");
  std::size_t meshes = 0, refused = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string error =
        errorOf(write("t.3ds", mutated(original, random)), {.seconds = 10, .bytes = kPlenty.bytes});
    ++(error.empty() ? meshes : refused);
  }
  EXPECT_GT(meshes, count / 20);
  EXPECT_GT(refused, count / 20);
}

}  // namespace mesh_process_test
}  // namespace hpsdf::app
