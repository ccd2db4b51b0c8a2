// Tests of libhpsdf.so from C++, which has the values of the C++ library at hand, and of what the library exports. The
// header hpsdf.h is compiled as C++ here, and as C in c_program.c.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hpsdf.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace c_interface_test {

using testing::HasSubstr;
using MeshHandle = std::unique_ptr<hpsdf_mesh, decltype(&hpsdf_mesh_free)>;
using OptionsHandle = std::unique_ptr<hpsdf_options, decltype(&hpsdf_options_free)>;
using DistanceHandle = std::unique_ptr<hpsdf_distance, decltype(&hpsdf_distance_free)>;
using FieldHandle = std::unique_ptr<hpsdf_field, decltype(&hpsdf_field_free)>;

constexpr std::array<double, 6> kBox = {-1.2, -1.2, -1.2, 1.2, 1.2, 1.2};

void expectOk(hpsdf_status status) { EXPECT_EQ(status, HPSDF_OK) << hpsdf_last_error(); }

OptionsHandle optionsWith(const std::vector<std::array<const char*, 2>>& settings) {
  hpsdf_options* options = nullptr;
  expectOk(hpsdf_options_new(&options));
  for (const auto& [name, value] : settings) expectOk(hpsdf_options_set(options, name, value));
  return {options, &hpsdf_options_free};
}

MeshHandle torus() {
  hpsdf_mesh* mesh = nullptr;
  expectOk(hpsdf_mesh_load("builtin:torus", nullptr, &mesh));
  return {mesh, &hpsdf_mesh_free};
}

std::vector<Vector3> latticePoints() {
  std::vector<Vector3> points;
  for (int x = 0; x < 5; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 5; ++z) points.emplace_back(0.53 * x - 1.1, 0.53 * y - 1.1, 0.53 * z - 1.1);
  return points;
}

std::string fileText(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_TRUE(stream.good()) << file;
  return text.str();
}

/// Returns what a command writes to its standard output. The command must succeed.
std::string outputOf(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error(command);
  std::string text;
  std::array<char, 4096> piece;
  while (const std::size_t bytes = std::fread(piece.data(), 1, piece.size(), pipe)) text.append(piece.data(), bytes);
  EXPECT_EQ(pclose(pipe), 0) << command;
  return text;
}

/// Calls a C++ function as the distance of a construction.
int callFunction(void* user, const double* points, size_t count, double* distances) {
  return (*static_cast<std::function<int(const double*, std::size_t, double*)>*>(user))(points, count, distances);
}

using Function = std::function<int(const double*, std::size_t, double*)>;

hpsdf_status builtStatus(Function function, const hpsdf_options* options) {
  hpsdf_field* field = nullptr;
  const hpsdf_status status = hpsdf_build_function(&callFunction, &function, kBox.data(), options, nullptr, &field);
  EXPECT_EQ(field != nullptr, status == HPSDF_OK);
  hpsdf_field_free(field);
  return status;
}

int sphere(const double* points, std::size_t count, double* distances) {
  for (std::size_t i = 0; i < count; ++i)
    distances[i] = std::hypot(points[3 * i], points[3 * i + 1], points[3 * i + 2]) - 1;
  return 0;
}

TEST(CInterface, hasTheVersionOfTheProject) { EXPECT_STREQ(hpsdf_version(), HPSDF_VERSION); }

TEST(CInterface, programInCPrintsTheValuesOfCpp) {
  const ExactDistance distance(loadMesh("builtin:torus"));
  const Field field = build(distance, domainAround(distance.source().box), {.targetError = 1e-5});
  std::string expected;
  for (const Vector3& x : latticePoints()) {
    const auto [value, gradient] = field.valueAndGradient(x);
    const ClosestPoint closest = distance.closestPoint(x);
    std::array<char, 1024> line;
    std::snprintf(line.data(), line.size(), "%.17g %.17g %.17g %.17g  %.17g %.17g %.17g %.17g %u %.17g %.17g %.17g\n",
                  value, gradient.x(), gradient.y(), gradient.z(), closest.signedDistance, closest.point.x(),
                  closest.point.y(), closest.point.z(), unsigned(closest.triangle), closest.barycentric.x(),
                  closest.barycentric.y(), closest.barycentric.z());
    expected += line.data();
  }
  EXPECT_EQ(outputOf(HPSDF_C_PROGRAM), expected);
}

TEST(CInterface, fieldsOfMeshesAndFilesAreThoseOfCpp) {
  const support::TemporaryDirectory folder;
  const std::string file = folder / "torus.hpsdf", smallFile = folder / "small.hpsdf";
  const MeshHandle mesh = torus();
  const OptionsHandle options = optionsWith({{"tolerance", "2%"}, {"threads", "1"}});
  hpsdf_field *field = nullptr, *loaded = nullptr, *mapped = nullptr;
  expectOk(hpsdf_build_mesh(mesh.get(), nullptr, options.get(), nullptr, &field));
  expectOk(hpsdf_field_save(field, file.c_str(), 0));
  expectOk(hpsdf_field_save(field, smallFile.c_str(), 1));
  expectOk(hpsdf_field_load(smallFile.c_str(), &loaded));
  expectOk(hpsdf_field_map(file.c_str(), &mapped));

  const TriangleMesh same = loadMesh("builtin:torus");
  const ExactDistance distance(same);
  BuildOptions settings{.targetError = 0};
  settings.tolerance = 2.0 / 100 * boundingBox(same).sizes().maxCoeff();
  const Field expected = build(distance, domainAround(same), settings);
  save(expected, folder / "expected.hpsdf");
  EXPECT_EQ(fileText(file), fileText(folder / "expected.hpsdf"));
  EXPECT_LT(fileText(smallFile).size(), fileText(file).size());
  EXPECT_EQ(hpsdf_field_bytes(field), expected.bytes());

  for (const Vector3& x : latticePoints()) {
    double value = 0, valueToo = 0;
    Vector3 gradient;
    expectOk(hpsdf_field_values(loaded, x.data(), 1, &value));
    expectOk(hpsdf_field_gradients(loaded, x.data(), 1, &valueToo, gradient.data()));
    EXPECT_EQ(value, expected.value(x));
    EXPECT_EQ(valueToo, value);
    EXPECT_EQ(gradient, expected.valueAndGradient(x).gradient);
    expectOk(hpsdf_field_values(mapped, x.data(), 1, &value));
    EXPECT_EQ(value, expected.value(x));
  }
  hpsdf_field_free(field);
  hpsdf_field_free(loaded);
  hpsdf_field_free(mapped);

  EXPECT_EQ(hpsdf_field_map(smallFile.c_str(), &mapped), HPSDF_FILE_ERROR);
  EXPECT_THAT(hpsdf_last_error(), HasSubstr("because it is compressed"));
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(-200, std::ios::end).write("damage", 6);
  EXPECT_EQ(hpsdf_field_map(file.c_str(), &mapped), HPSDF_FILE_ERROR);
  EXPECT_THAT(hpsdf_last_error(), HasSubstr("damaged"));
}

TEST(CInterface, insideTestsAreThoseOfCpp) {
  const MeshHandle mesh = torus();
  const std::vector<Vector3> points = latticePoints();
  for (const hpsdf_inside_test test : {HPSDF_INSIDE_PSEUDONORMAL, HPSDF_INSIDE_WINDING, HPSDF_INSIDE_SHELL}) {
    const double thickness = test == HPSDF_INSIDE_SHELL ? 0.01 : 0;
    hpsdf_distance* made = nullptr;
    expectOk(hpsdf_distance_new(mesh.get(), test, thickness, 1, nullptr, &made));
    const DistanceHandle distance(made, &hpsdf_distance_free);
    std::vector<double> distances(points.size()), expected(points.size());
    expectOk(hpsdf_distance_values(made, points[0].data(), points.size(), distances.data()));
    const ExactDistance same(loadMesh("builtin:torus"),
                             {.insideTest = static_cast<InsideTest>(test), .thickness = thickness});
    same(points, expected);
    EXPECT_EQ(distances, expected);
  }
}

TEST(CInterface, oneThreadCallsTheFunctionsOfTheCaller) {
  const OptionsHandle options = optionsWith({{"target-error", "1e-6"}, {"threads", "1"}});
  struct Calls {
    std::thread::id caller = std::this_thread::get_id();
    std::atomic<int> here = 0, elsewhere = 0;
    void count() { ++(std::this_thread::get_id() == caller ? here : elsewhere); }
  } calls;
  Function function = [&](const double* points, std::size_t count, double* distances) {
    calls.count();
    return sphere(points, count, distances);
  };
  const hpsdf_progress progress = {&calls, [](void* user, const char*, double) { static_cast<Calls*>(user)->count(); },
                                   [](void* user) {
                                     static_cast<Calls*>(user)->count();
                                     return 0;
                                   }};
  hpsdf_field* field = nullptr;
  expectOk(hpsdf_build_function(&callFunction, &function, kBox.data(), options.get(), &progress, &field));
  hpsdf_field_free(field);
  EXPECT_GT(calls.here, 100);
  EXPECT_EQ(calls.elsewhere, 0);
}

TEST(CInterface, exceptionsOfFunctionsBecomeErrors) {
  for (const char* threads : {"1", "0"}) {
    const OptionsHandle options = optionsWith({{"threads", threads}});
    EXPECT_EQ(builtStatus([](auto...) -> int { throw std::runtime_error("no way"); }, options.get()),
              HPSDF_GENERAL_ERROR);
    EXPECT_STREQ(hpsdf_last_error(), "no way");
    EXPECT_EQ(builtStatus([](auto...) -> int { throw std::bad_alloc(); }, options.get()), HPSDF_LIMIT_ERROR);
    EXPECT_THAT(hpsdf_last_error(), HasSubstr("not enough memory"));
    EXPECT_EQ(builtStatus([](auto...) -> int { throw 3; }, options.get()), HPSDF_GENERAL_ERROR);
    EXPECT_EQ(builtStatus([](auto...) { return -1; }, options.get()), HPSDF_CALLBACK_ERROR);
    EXPECT_STREQ(hpsdf_last_error(), "the function of the distance has returned -1");
    std::atomic<int> calls = 0;
    const auto failsLater = [&](const double* points, std::size_t count, double* distances) {
      return ++calls > 50 ? 7 : sphere(points, count, distances);
    };
    EXPECT_EQ(builtStatus(failsLater, options.get()), HPSDF_CALLBACK_ERROR);
  }
}

TEST(CInterface, functionsMayCallTheLibrary) {
  const OptionsHandle options = optionsWith({{"max-steps", "1"}, {"grid", "2"}});
  const auto nested = [&](const double* points, std::size_t count, double* distances) {
    hpsdf_field* field = nullptr;
    Function function = &sphere;
    hpsdf_status status = hpsdf_build_function(&callFunction, &function, kBox.data(), options.get(), nullptr, &field);
    if (status == HPSDF_OK) status = hpsdf_field_values(field, points, count, distances);
    hpsdf_field_free(field);
    return int(status);
  };
  EXPECT_EQ(builtStatus(nested, options.get()), HPSDF_OK) << hpsdf_last_error();
}

TEST(CInterface, eachThreadHasItsOwnMessage) {
  EXPECT_EQ(hpsdf_field_load("here.hpsdf", nullptr), HPSDF_ARGUMENT_ERROR);
  const std::string here = hpsdf_last_error();
  std::thread([] {
    EXPECT_STREQ(hpsdf_last_error(), "");
    hpsdf_field* field = nullptr;
    EXPECT_EQ(hpsdf_field_load("there.hpsdf", &field), HPSDF_FILE_ERROR);
    EXPECT_THAT(hpsdf_last_error(), HasSubstr("there.hpsdf"));
  }).join();
  EXPECT_EQ(hpsdf_last_error(), here);
}

TEST(CInterface, severalThreadsUseOneObject) {
  const MeshHandle mesh = torus();
  const OptionsHandle options = optionsWith({{"target-error", "1e-5"}});
  hpsdf_distance* madeDistance = nullptr;
  expectOk(hpsdf_distance_new(mesh.get(), HPSDF_INSIDE_AUTOMATIC, 0, 0, nullptr, &madeDistance));
  const DistanceHandle distance(madeDistance, &hpsdf_distance_free);
  const std::vector<Vector3> points = latticePoints();
  std::array<std::vector<double>, 3> results;
  std::vector<std::thread> threads;
  for (std::vector<double>& result : results)
    threads.emplace_back([&] {
      hpsdf_field* field = nullptr;
      expectOk(hpsdf_build_distance(distance.get(), nullptr, options.get(), nullptr, &field));
      const FieldHandle owned(field, &hpsdf_field_free);
      result.resize(2 * points.size());
      expectOk(hpsdf_field_values(field, points[0].data(), points.size(), result.data()));
      expectOk(hpsdf_distance_values(distance.get(), points[0].data(), points.size(), &result[points.size()]));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(results[1], results[0]);
  EXPECT_EQ(results[2], results[0]);
}

/// Returns the symbols that the library defines, each with its version: "hpsdf_version@@HPSDF_0.2".
std::set<std::string> exportedSymbols() {
  std::istringstream lines(outputOf(HPSDF_NM " --dynamic --defined-only " HPSDF_C_LIBRARY));
  std::set<std::string> symbols;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string address, type, name;
    words >> address >> type >> name;
    if (type != "A") symbols.insert(name);  // the name of the version is a symbol too
  }
  return symbols;
}

TEST(CInterface, exportsTheFunctionsOfItsHeaderUnderItsVersion) {
  const std::string header = fileText(HPSDF_SOURCE_DIR "/c/include/hpsdf.h");
  const std::string version = HPSDF_VERSION;
  const std::string suffix = "@@HPSDF_" + version.substr(0, version.rfind('.'));
  const std::string begin = "\nHPSDF_API ";  // of the declaration of a function
  std::set<std::string> expected;
  for (std::size_t at = header.find(begin); at != std::string::npos; at = header.find(begin, at + 1)) {
    const std::size_t end = header.find('(', at), name = header.rfind("hpsdf_", end);
    expected.insert(header.substr(name, end - name) + suffix);
  }
  EXPECT_GT(expected.size(), 20u);
  EXPECT_EQ(exportedSymbols(), expected);
}

TEST(CInterface, isDocumentedByAProgramThatIsTested) {
  const std::string program = fileText(HPSDF_SOURCE_DIR "/tests/consumer/c/use_c.c");
  EXPECT_THAT(fileText(HPSDF_SOURCE_DIR "/docs/c.md"), HasSubstr("```c\n" + program + "```"));
}

}  // namespace c_interface_test
}  // namespace hpsdf
