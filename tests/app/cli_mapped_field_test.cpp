// Tests commands on a field that is larger than half of the memory that the program may take.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "cli_fixture.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {
namespace cli_mapped_field_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)

constexpr int kStoredDegree = 15;
constexpr std::size_t kAddressKilobytes = 500'000;

/// Returns the coefficients of a polynomial of degree `kStoredDegree` that equals one of lower degree.
std::vector<double> raised(const double* coefficients, int degree) {
  std::vector<double> result;
  for (int i = 0; i <= kStoredDegree; ++i)
    for (int j = 0; i + j <= kStoredDegree; ++j)
      for (int k = 0; i + j + k <= kStoredDegree; ++k) result.push_back(i + j + k <= degree ? *coefficients++ : 0);
  return result;
}

/// Returns a field of the torus that takes more bytes than it needs, because all cells have degree `kStoredDegree`.
Field largeField() {
  const ExactDistance torus(loadMesh("builtin:torus"));
  const Field small = build(torus, domainAround(torus.source().box), {.targetError = 1e-2, .grid = {33, 33, 33}});
  FieldData data = small.data();
  std::vector<double> coefficients;
  for (std::uint64_t& bits : data.nodes) {
    if (!node::isLeaf(bits)) continue;
    const std::vector<double> ofLeaf = withCoefficients(small.data(), bits, [&](const auto* stored) {
      const std::vector<double> low(stored, stored + coefficientCount(node::degree(bits)));
      return raised(low.data(), node::degree(bits));
    });
    bits = node::leaf(kStoredDegree, std::uint32_t(coefficients.size()));
    coefficients.insert(coefficients.end(), ofLeaf.begin(), ofLeaf.end());
  }
  data.coefficients = FieldArray<double>(std::move(coefficients));
  return Field(std::move(data));
}

class MappedField : public Cli {
 protected:
  void SetUp() override {
#ifdef HPSDF_SANITIZED
    GTEST_SKIP() << "sanitizers take terabytes of addresses: no limit can be set";
#endif
    save(largeField(), at("large.hpsdf"));
    ASSERT_GT(double(fs::file_size(at("large.hpsdf"))), 0.75 * 1024 * kAddressKilobytes / 2);
  }

  /// Runs a command with all memory and with little. Returns the outcome with little, which may differ from the other
  /// in lines of `info` and of standard error alone.
  Outcome expectSame(const Call& call) {
    const Outcome expected = run(call);
    EXPECT_EQ(expected.status, 0) << expected.err;
    const std::string picture = readFileIfThere("out.png");
    Call limited = call;
    limited.addressKilobytes = kAddressKilobytes;
    limited.environment["MALLOC_ARENA_MAX"] = "1";
    Outcome found = run(limited);
    EXPECT_EQ(found.status, 0) << found.err;
    EXPECT_EQ(found.out, expected.out);
    EXPECT_TRUE(readFileIfThere("out.png") == picture);
    return found;
  }

 private:
  std::string readFileIfThere(const std::string& name) {
    if (!fs::exists(at(name))) return "";
    std::string bytes = readFile(at(name));
    fs::remove(at(name));
    return bytes;
  }
};

TEST_F(MappedField, CommandsGiveWhatTheyGiveOfAFieldInMemory) {
  const std::string field = at("large.hpsdf");
  expectSame({{"query", field}, "0.5 0.1 0\n0.7 0.2 0.1\n-0.4 0.9 0.01\n"});
  expectSame({{"slice", field, "-o", at("out.png"), "--size", "300x200", "--cpu"}});
  expectSame({{"render", field, "-o", at("out.png"), "--size", "300x200", "--cpu"}});
  expectSame({{"verify", field, "--points", "20000", "--threads", "2"}});
  Call info{{"info", field}};
  info.addressKilobytes = kAddressKilobytes;
  EXPECT_THAT(run(info).out, HasSubstr("of the file mapped"));
  info.addressKilobytes = 0;
  EXPECT_THAT(run(info).out, Not(HasSubstr("mapped")));
}

TEST_F(MappedField, IsDrawnOnTheCpuUnlessADeviceIsChosen) {
  Call slice{{"slice", at("large.hpsdf"), "-o", at("out.png"), "--size", "300x200"}};
  slice.addressKilobytes = kAddressKilobytes;
  slice.environment["MALLOC_ARENA_MAX"] = "1";
  const Outcome outcome = run(slice);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out + outcome.err, HasSubstr("CPU"));
}

}  // namespace cli_mapped_field_test
}  // namespace hpsdf::app
