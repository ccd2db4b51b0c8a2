// Tests that every command of the registry that works on a field works on fields with exact leaves, with both
// renderers. A command that is added to the registry fails the test until it has a row in one of the tables below.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "commands/commands.h"
#include "files/data_table.h"
#include "files/text_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/image.h"
#include "language/script.h"
#include "session/session.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace exact_field_test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// Commands that do not work on a field, or that other tests try on fields with exact leaves.
const std::map<std::string, std::string> kExempt = {
    {"view", "opens a window, whose frames are those of 'shot'"},
    {"simulate", "needs Bullet; simulate_test.cpp tries it"},
    {"check", "runs scripts, of which these tests are examples"},
    {"accept", "copies pictures"},
    {"mesh", "works on meshes"},
    {"shapes", "lists shapes"},
    {"index", "lists what batches have built"},
    {"doctor", "describes the machine"},
    {"set", "defines variables"},
    {"include", "is replaced by lines of a script"},
    {"help", "explains commands"},
    {"docs", "explains commands"},
};

/// For each command, lines of a script that use the command on the current field. The variables are $field, the file of
/// the current field; $out, an empty folder for results; $points, a file of points; and $cpu, true or false.
const std::multimap<std::string, std::string> kTrials = {
    {"build", "build builtin:box strategy=hpx target-error=1e-3 grid=3 output=$out/f.hpsdf"},
    // The result has no exact leaves, so that it is not saved where the fields of a trial must have some.
    {"combine", "combine \"union($field, offset(builtin:box, 0.1))\" target-error=1e-2; expect at(0,0,0).value < -0.1"},
    {"open", "open $field; expect stats.exact_leaves.leaves > 0"},
    {"load", "load $field; expect stats.exact_leaves.leaves > 0"},
    {"save", "save output=$out/f.hpsdf"},
    {"save", "save output=$out/f.hpsdf compress=true; load $out/f.hpsdf; expect stats.exact_leaves.leaves > 0"},
    {"smooth", "smooth output=$out/f.hpsdf"},
    {"blend", "blend output=$out/f.hpsdf; expect stats.blend > 0"},
    {"bounds", "bounds output=$out/f.hpsdf; expect stats.bounds.greatest > 0"},
    {"info", "info; info json=true"},
    {"query", "query points=$points output=$out/distances.csv"},
    {"query", "query boxes=0,0,0,0.1,0.1,0.1 output=$out/ranges.csv"},
    {"jumps", "jumps output=$out/jumps.csv; jumps by=gradient"},
    {"verify", "verify points=2000 near=0.004 max-near-rms=1e-6 max-mismatches=0"},
    {"slice", "slice size=64x64 cpu=$cpu output=$out/degree.png"},
    {"slice", "slice color=depth plane=0,0,0,1,2,3 arrows=16 size=64x64 cpu=$cpu output=$out/depth.png"},
    {"slice", "slice color=distance size=64x64 cpu=$cpu output=$out/distance.png"},
    {"slice", "slice color=error size=64x64 cpu=$cpu output=$out/error.png"},
    {"slice", "slice color=difference other=$field size=64x64 cpu=$cpu output=$out/difference.pfm"},
    {"slice", "slice color=value-jump size=64x64 cpu=$cpu output=$out/value-jump.png"},
    {"slice", "slice color=gradient-jump size=64x64 cpu=$cpu output=$out/gradient-jump.png"},
    {"slice", "slice color=slope size=64x64 cpu=$cpu output=$out/slope.png"},
    {"slice", "slice color=cell-error size=64x64 cpu=$cpu output=$out/cell-error.png"},
    {"slice", "slice color=degree size=64x64 cpu=$cpu output=$out/degree.pfm"},
    {"slice", "slice size=64x64 cpu=$cpu output=$out/values.csv"},
    {"slice",
     "slice operands=\"union($field, move(builtin:sphere, 0.5, 0, 0))\" size=64x64 cpu=$cpu output=$out/operands.png"},
    {"render", "render samples=2 size=64x64 cpu=$cpu output=$out/surface.png"},
    {"render", "render color=degree clip=z cracks=true plane=x size=64x64 cpu=$cpu output=$out/degree.png"},
    {"render", "render color=depth offset=0.05 arrows=16 size=64x64 cpu=$cpu output=$out/depth.png"},
    {"render", "render color=error projection=orthographic size=64x64 cpu=$cpu output=$out/error.png"},
    {"render", "render cells=boxes degrees=exact color=degree size=64x64 cpu=$cpu output=$out/boxes.png"},
    {"render", "render cells=lines color=gradient-jump size=64x64 cpu=$cpu output=$out/lines.png"},
    {"compare", "compare $field $field points=2000 size=64x64 samples=1 cpu=$cpu output=$out/compare.html"},
    {"turntable", "turntable frames=2 size=64x64 cpu=$cpu output=$out/turn"},
    {"frames",
     "frames builtin:box strategy=hpx target-error=1e-2 grid=3 frames=2 of=\"slice size=64x64 cpu=$cpu\" "
     "output=$out/frames"},
    {"pick",
     "slice offset=0.24 zoom=40 target=0.3,0,0.24 size=160x120 cpu=$cpu output=$out/p.png; pick 60,50; "
     "expect pick(60,50).degree == exact"},
    {"expect", "expect at(0.3,0,0.25).degree == exact; expect at(1,1,1).degree != exact; expect jumps.max < 1"},
    {"probe", "probe from=-0.9,0,0.24 to=0.9,0,0.24 samples=50 output=$out/line.csv"},
    {"probe", "probe from=-0.9,0,0.24 to=0.9,0,0.24 samples=50 size=320x240 output=$out/line.png"},
    {"contour", "contour output=$out/surface.ply tolerance=1%"},
    {"contour", "contour output=$out/colored.glb tolerance=1% color=degree"},
    {"export", "export resolution=4 points=100 output=$out/grid.cdf"},
    {"sample", "sample surface=100 near=100 uniform=100 output=$out/samples.csv"},
    {"export", "export resolution=4 gradients=true output=$out/grid.vti"},
    {"export", "export order=3 output=$out/leaves.vtu"},
    {"show", "show slice; shot output=$out/shot.png"},
    {"camera", "camera 120,10,0.9; shot output=$out/shot.png"},
    {"surface", "surface offset=0.02 clip=z cracks=true; shot output=$out/shot.png"},
    {"plane", "plane axis=x offset=0.1 in-space=true; shot output=$out/shot.png"},
    {"color", "color degree; shot output=$out/shot.png"},
    {"cells", "cells boxes degrees=exact; shot output=$out/shot.png"},
    {"arrows", "arrows 30; shot output=$out/shot.png"},
    {"triangles", "triangles shown=true tolerance=1% simplify=true; shot output=$out/shot.png"},
    {"beside", "beside $field; color difference other=$field; shot output=$out/shot.png; beside none"},
    {"panel", "show slice size=480x360; panel all=true; shot output=$out/shot.png"},
    {"preset", "show slice size=480x360; preset degrees; shot output=$out/shot.png"},
    {"worst", "show slice size=480x360; panel worst=true; worst by=gradient page=1; shot output=$out/shot.png"},
    {"fly", "fly to=0.3,0,0.25; shot output=$out/shot.png"},
    {"undo", "color degree; undo; shot output=$out/shot.png"},
    {"redo", "color degree; undo; redo; shot output=$out/shot.png"},
    {"copy-view", "cells lines degrees=exact; copy-view output=$out/view.hps"},
    {"settings", "settings strategy=hpx target-error=1e-2; apply; save output=$out/f.hpsdf"},
    {"apply", "apply max-steps=10; save output=$out/f.hpsdf"},
    {"rebuild",
     "rebuild before=builtin:gear,teeth=3,segments=1 after=builtin:gear,teeth=3,segments=1,hole=0.28 "
     "output=$out/f.hpsdf; expect stats.exact_leaves.leaves > 0"},
    {"shot", "show slice; shot output=$out/shot.png; pick 60,50"},
    {"ui", "show slice size=480x360; panel all=true; ui hover canvas; ui wheel canvas 1; shot output=$out/shot.png"},
    {"report", "report samples=1 cpu=$cpu output=$out/report"},
    {"page", "page output=$out/page.html"},
    {"study",
     "study table builtin:box strategy=hpx target-error=1e-2 grid=3 points=100 cpu=$cpu output=$out/table; "
     "study continuity builtin:box strategy=hpx target-error=1e-2 grid=3 points=100 weights=1 output=$out/continuity; "
     "study tradeoff builtin:box strategy=hpx target-errors=1e-2 grid=3 points=100 output=$out/tradeoff"},
    {"why", "why point=0.3,0,0.2 json=true; expect why(0.3,0,0.2).agrees == 1"},
    {"run", "run execute=\"info $field\""},
};

/// Commands whose trials take long. Short rounds leave them out.
const std::set<std::string> kSlow = {"report", "study", "turntable", "frames"};

/// A kind of field with exact leaves and a renderer.
struct Round {
  const char* name;
  const char* options;   ///< options of `build` in which the kinds of fields differ
  bool cpu = false;      ///< draws on the CPU; only the trials that draw are run
  bool isShort = false;  ///< leaves out slow commands, and all trials of a command but the first

  friend std::ostream& operator<<(std::ostream& out, const Round& round) { return out << round.name; }
};
constexpr Round kRounds[] = {
    {.name = "singleByOpenGl", .options = "coefficients=float"},
    {.name = "doubleOnCpu", .options = "coefficients=double", .cpu = true},
    {.name = "blended", .options = "continuity=exact", .isShort = true},
    {.name = "doubleWithBounds", .options = "coefficients=double bounds=true", .isShort = true}};

void expectPicture(const fs::path& file) {
  const render::Image image = render::loadPng(file);
  const bool isUniform = std::ranges::all_of(image.pixels, [&](const auto& pixel) { return pixel == image.pixels[0]; });
  EXPECT_FALSE(isUniform) << file << " has one colour only";
}

/// Expects that a file that a command has written holds what its extension promises.
void expectSane(const fs::path& file) {
  const std::string extension = file.extension();
  EXPECT_GT(fs::file_size(file), 0u) << file;
  if (extension == ".png") expectPicture(file);
  if (extension == ".hpsdf") {
    EXPECT_GT(statistics(load(file)).exact.leaves, 0u) << file;
  }
  const bool hasNames = file.stem() == "continuity" || file.stem() == "tradeoff";  // not a table of numbers alone
  if (extension == ".pfm" || (extension == ".csv" && !hasNames)) {
    EXPECT_GT(loadData(file).rows, 0u) << file;
  }
}

/// A session, in which commands are tried on one field with exact leaves.
class Bench {
 public:
  explicit Bench(const Round& round) : cpu_(round.cpu) {
    run("build builtin:gear,teeth=3,segments=1 strategy=hpx exact-triangles=16 target-error=1e-3 grid=3 "
        "output=$field " +
        std::string(round.options));
    writeTextFile(folder_ / "points.csv", "0,0,0\n0.3,0,0.25\n0.31,0,0.24\n3,2,1\n");
  }

  const Registry& registry() const { return registry_; }

  /// Runs the lines on the field, with the explorer open. Expects that they succeed without an error on the console,
  /// and that the files which they write are sane.
  void expectWorks(const std::string& lines) {
    const support::TemporaryDirectory out;
    try {
      run("load $field; show surface cpu=$cpu size=96x72; panel all=false");
      out_.str({});
      err_.str({});
      run(lines, out.path());
      for (const auto& entry : fs::recursive_directory_iterator(out.path()))
        if (entry.is_regular_file()) expectSane(entry.path());
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
    EXPECT_THAT(err_.str(), Not(HasSubstr("error")));
  }

 private:
  void run(const std::string& lines, const fs::path& out = {}) {
    const std::string cpu = cpu_ ? "true" : "false";
    const Variables variables = {{"field", (folder_ / "field.hpsdf").string()},
                                 {"points", (folder_ / "points.csv").string()},
                                 {"out", out.string()},
                                 {"cpu", cpu}};
    runScript(session_, parseScript(registry_, "trial", lines, variables));
  }

  bool cpu_;
  support::TemporaryDirectory folder_;
  Registry registry_ = makeRegistry();
  std::istringstream in_;
  std::ostringstream out_, err_;
  Session session_{registry_, Console{in_, out_, err_}};
};

class ExactField : public testing::TestWithParam<Round> {};

/// Returns the trials of a command that belong to the round.
std::vector<std::string> trialsOf(const std::string& command, const Round& round) {
  std::vector<std::string> trials;
  const auto [first, last] = kTrials.equal_range(command);
  EXPECT_NE(first, last) << "add a row for this command to kTrials or kExempt";
  for (auto trial = first; trial != last; ++trial) {
    const std::string& lines = trial->second;
    const bool draws = lines.find("$cpu") != std::string::npos || lines.find("shot ") != std::string::npos;
    if (draws || !round.cpu) trials.push_back(lines);
  }
  if (round.isShort && kSlow.contains(command)) return {};
  if (round.isShort && trials.size() > 1) trials.resize(1);
  return trials;
}

TEST_P(ExactField, everyCommandWorks) {
  const Round& round = GetParam();
  if (!round.cpu) HPSDF_REQUIRE_GL();
  Bench bench(round);
  for (const Command& command : bench.registry().commands()) {
    if (kExempt.contains(command.name)) continue;
    SCOPED_TRACE(command.name);
    for (const std::string& lines : trialsOf(command.name, round)) {
      SCOPED_TRACE(lines);
      bench.expectWorks(lines);
    }
  }
}

std::string nameOf(const testing::TestParamInfo<Round>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Rounds, ExactField, testing::ValuesIn(kRounds), nameOf);

TEST(ExactFieldTables, nameKnownCommandsOnce) {
  const Registry registry = makeRegistry();
  for (const auto& [name, lines] : kTrials) {
    EXPECT_NO_THROW(registry.command(name));
    EXPECT_FALSE(kExempt.contains(name)) << name;
  }
  for (const auto& [name, reason] : kExempt) EXPECT_NO_THROW(registry.command(name)) << reason;
}

}  // namespace exact_field_test
}  // namespace hpsdf::app
