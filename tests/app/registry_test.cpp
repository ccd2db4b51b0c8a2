#include "language/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <new>
#include <set>
#include <sstream>

#include "commands/commands.h"
#include "console/error_text.h"
#include "construction/build_arguments.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/render/picture.h"
#include "language/help.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"

namespace hpsdf::app {
namespace registry_test {

using testing::HasSubstr;

std::vector<Word> wordsOf(const std::string& line) {
  std::vector<Word> words;
  std::istringstream in(line);
  for (std::string word; in >> word;) words.push_back({.text = word});
  return words;
}

Arguments parse(const std::string& verb, const std::string& line) {
  static const Registry registry = makeRegistry();
  return parseArguments(registry.command(verb), wordsOf(line), Origin::commandLine);
}

std::string complaint(const std::string& verb, const std::string& line) {
  try {
    parse(verb, line);
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(Registry, everyCommandExplainsItself) {
  const Registry registry = makeRegistry();
  std::set<std::string> names;
  for (const Command& command : registry.commands()) {
    SCOPED_TRACE(command.name);
    EXPECT_TRUE(names.insert(command.name).second);
    EXPECT_FALSE(command.summary.empty());
    EXPECT_FALSE(command.help.empty());
    EXPECT_FALSE(command.examples.empty());
    EXPECT_TRUE(command.action);
    EXPECT_NE(findParameter(command, "json"), nullptr);
    std::set<std::string> parameters;
    for (const Parameter& parameter : command.parameters) {
      SCOPED_TRACE(parameter.name);
      EXPECT_TRUE(parameters.insert(parameter.name).second);
      EXPECT_FALSE(parameter.help.empty());
      EXPECT_THAT(commandHelp(command, HelpDetail::all),
                  HasSubstr(parameter.isPositional ? parameter.valueName : "--" + parameter.name));
    }
  }
}

TEST(Registry, keepsPublishedNames) {
  const Registry registry = makeRegistry();
  const std::vector<std::pair<std::string, std::vector<std::string>>> fixed = {
      {"build",
       {"target-error", "grid",     "nearness",     "max-degree", "max-depth",         "domain",      "margin",
        "normalize",    "strategy", "coefficients", "quadrature", "cubature",          "band",        "threads",
        "max-steps",    "paper",    "enrich",       "continuity", "continuity-weight", "blend-width", "json"}},
      {"smooth", {"output", "continuity-weight", "threads", "json"}},
      {"blend", {"output", "width", "json"}},
      {"info", {"json"}},
      {"query", {"boxes", "json"}},
      {"slice", {"axis", "offset", "plane", "color", "size", "cpu", "gl"}},
      {"why", {"point", "mesh", "json"}},
      {"probe", {"from", "to", "output", "samples", "mesh", "size"}},
      {"render", {"color", "camera", "up", "offset", "size", "cpu", "gl"}},
  };
  for (const auto& [verb, names] : fixed)
    for (const std::string& name : names)
      EXPECT_NE(findParameter(registry.command(verb), name), nullptr) << verb << " --" << name;
}

TEST(Registry, examplesAreValid) {
  const Registry registry = makeRegistry();
  std::size_t checked = 0;
  for (const Command& command : registry.commands())
    for (const std::string& example : command.examples) {
      // Examples with quotes and pipes need a shell and are not checked.
      if (example.find_first_of("'|") != std::string::npos) continue;
      ++checked;
      if (command.includesScript) {  // the example names a file that does not exist
        const auto words = wordsOf(example);
        EXPECT_NO_THROW(parseArguments(command, std::span(words).subspan(1), Origin::script)) << example;
        continue;
      }
      if (command.scriptOnly) {
        EXPECT_NO_THROW(parseScript(registry, "example", example, {})) << example;
        continue;
      }
      auto words = wordsOf(example);
      words.erase(words.begin());  // removes the program's name
      const Command& called = registry.command(words.front().text);
      words.erase(words.begin());
      EXPECT_NO_THROW(parseArguments(called, words, Origin::commandLine)) << example;
    }
  EXPECT_GE(checked, 15u);
}

void expectEqual(const BuildOptions& a, const BuildOptions& b) {
  EXPECT_EQ(a.targetError.weighted(), b.targetError.weighted());
  EXPECT_EQ(a.grid, b.grid);
  EXPECT_EQ(a.nearness, b.nearness);
  EXPECT_EQ(a.maxDegree, b.maxDegree);
  EXPECT_EQ(a.maxDepth, b.maxDepth);
  EXPECT_EQ(a.strategy, b.strategy);
  EXPECT_EQ(a.quadrature, b.quadrature);
  EXPECT_EQ(a.cubature, b.cubature);
  EXPECT_EQ(a.trialSamples, b.trialSamples);
  EXPECT_EQ(a.band, b.band);
  EXPECT_EQ(a.maxSteps, b.maxSteps);
  EXPECT_EQ(a.enrich, b.enrich);
  EXPECT_EQ(a.continuityWeight, b.continuityWeight);
  EXPECT_EQ(a.coefficients, b.coefficients);
  EXPECT_EQ(a.threads, b.threads);
}

TEST(BuildArguments, defaultsAreThoseOfCore) {
  expectEqual(buildOptions(parse("build", "m.obj -o f"), 2), BuildOptions{});
}

TEST(BuildArguments, paperIsThePapers) {
  expectEqual(buildOptions(parse("build", "m.obj -o f --paper"), 2), paperOptions());
}

TEST(BuildArguments, whatIsWrittenBesidePaperWins) {
  BuildOptions expected = paperOptions();
  expected.nearness = 7;
  expected.maxDegree = 12;
  expected.maxDepth = 3;
  expected.quadrature = 5;
  expected.cubature = CubatureKind::compact;
  expected.strategy = Strategy::h2;
  expected.coefficients = CoefficientType::float32;
  expectEqual(buildOptions(parse("build",
                                 "m.obj -o f --nearness 7 --max-degree 12 --max-depth 3 --quadrature 5 --strategy h2 "
                                 "--cubature compact --coefficients float --paper"),
                           2),
              expected);
}

TEST(BuildArguments, allAreRead) {
  const BuildOptions options = buildOptions(parse("build",
                                                  "m.obj -o f --target-error 2.5e-7 --grid 3,4,5 --strategy h1 "
                                                  "--coefficients double --band 0.25 --cubature product "
                                                  "--threads 3 --max-steps 0"),
                                            2);
  EXPECT_EQ(options.targetError.weighted(), 2.5e-7);
  EXPECT_EQ(options.grid, (std::array<std::uint32_t, 3>{3, 4, 5}));
  EXPECT_EQ(options.strategy, Strategy::h1);
  EXPECT_EQ(options.coefficients, CoefficientType::float64);
  EXPECT_EQ(options.band, 0.25);
  EXPECT_EQ(options.cubature, CubatureKind::product);
  EXPECT_EQ(options.threads, 3);
  EXPECT_EQ(options.maxSteps, 0u);
}

TEST(BuildArguments, targetErrorAndErrorsByDistanceExcludeEachOther) {
  const BuildOptions options = buildOptions(parse("build", "m.obj -o f --near-error 1e-3 --far-error 1e-2"), 2);
  EXPECT_EQ(options.targetError.byDistance().near, 1e-3);
  EXPECT_EQ(options.targetError.byDistance().far, 1e-2);
  EXPECT_THROW(buildOptions(parse("build", "m.obj -o f --near-error 1e-3 --far-error 1e-2 --target-error 1e-5"), 2),
               Error);
}

/// If no option limits the size of the field, a default memory limit applies.
TEST(BuildArguments, memoryIsLimitedUnlessAnEndIsGiven) {
  const auto limit = [](const std::string& more) {
    return buildOptions(parse("build", "m.obj -o f" + more), 2).memoryLimit;
  };
  EXPECT_EQ(limit(""), 100'000'000u);
  EXPECT_EQ(limit(" --target-error 1e-6"), std::nullopt);
  EXPECT_EQ(limit(" --max-error 1e-3"), std::nullopt);
  EXPECT_EQ(limit(" --grid 100"), std::nullopt);
  EXPECT_EQ(limit(" --max-steps 0"), std::nullopt);
  EXPECT_EQ(limit(" --max-depth 3 --paper"), 100'000'000u);
  EXPECT_EQ(limit(" --memory-limit 3e9"), 3'000'000'000u);
  EXPECT_EQ(limit(" --memory-limit 3e9 --target-error 1e-6"), 3'000'000'000u);
}

TEST(BuildArguments, errorsOfMemoryNameTheOption) {
  const auto text = [](const std::string& more, std::uint64_t enough) {
    const Arguments arguments = parse("build", "m.obj -o f" + more);
    try {
      withinMemory(arguments, [&] { throw MemoryLimitError("much is needed: take less", enough); });
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::limit);
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  EXPECT_EQ(text(" --grid 9", 210'000'000),
            "much is needed: take less, or allow more memory: --memory-limit 2.1e8 is likely to suffice");
  EXPECT_EQ(text("", 210'000'000),
            "much is needed: take less, or allow more memory: --memory-limit 2.1e8 is likely to suffice (where no "
            "target is given either, 0.1 GB are allowed besides the mesh's distance)");
  EXPECT_EQ(text(" --memory-limit 3e9", 0), "much is needed: take less; this machine does not allow more memory");
}

/// A memory limit helps only where the program itself refuses to take more.
TEST(BuildArguments, errorsOfTheSystemsMemoryFitTheWork) {
  try {
    withinMemory(parse("build", "m.obj -o f"), []() -> int { throw std::bad_alloc(); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::limit);
    EXPECT_STREQ(error.what(), "not enough memory; a larger tolerance or target error, or a coarser grid, needs less");
  }
  EXPECT_EQ(errorText(std::bad_alloc()),
            "not enough memory; end other programs, or take a smaller mesh, field or picture");
}

TEST(BuildArguments, readContinuity) {
  EXPECT_EQ(buildOptions(parse("build", "m.obj -o f --continuity none"), 2).continuityWeight, std::nullopt);
  EXPECT_EQ(buildOptions(parse("build", "m.obj -o f --continuity weak"), 2).continuityWeight, WeakContinuity{}.weight);
  const BuildOptions options =
      buildOptions(parse("build", "m.obj -o f --continuity weak --continuity-weight 7 --enrich"), 2);
  EXPECT_EQ(options.continuityWeight, 7);
  EXPECT_TRUE(options.enrich);
  EXPECT_THROW(buildOptions(parse("build", "m.obj -o f --continuity-weight 7"), 2), Error);
}

TEST(Arguments, agreeForScriptsAndCommandLine) {
  const Registry registry = makeRegistry();
  const Command& command = registry.command("slice");
  const std::vector<Word> script = {{.text = "f.hpsdf", .column = 7},
                                    {.text = "offset=-0.25", .column = 15, .equals = 6},
                                    {.text = "size=64x32", .column = 28, .equals = 4},
                                    {.text = "output=x y.png", .column = 39, .equals = 6}};
  const std::vector<Word> dashed = {{.text = "f.hpsdf"},      {.text = "--offset"}, {.text = "-0.25"},
                                    {.text = "--size=64x32"}, {.text = "-o"},       {.text = "x y.png"}};
  const auto expectSame = [](const Arguments& arguments) {
    EXPECT_EQ(arguments.text("field"), "f.hpsdf");
    EXPECT_EQ(arguments.number("offset"), -0.25);
    EXPECT_EQ(arguments.size("size"), (std::array<int, 2>{64, 32}));
    EXPECT_EQ(arguments.text("output"), "x y.png");
    EXPECT_FALSE(arguments.given("axis"));
    EXPECT_EQ(arguments.text("axis"), "z");
  };
  expectSame(parseArguments(command, script, Origin::script));
  expectSame(parseArguments(command, dashed, Origin::script));
  expectSame(parseArguments(command, dashed, Origin::commandLine));
}

TEST(Arguments, flagsAreOnOrOff) {
  EXPECT_FALSE(parse("build", "m -o f").flag("normalize"));
  EXPECT_TRUE(parse("build", "m -o f --normalize").flag("normalize"));
  EXPECT_TRUE(parse("build", "--normalize m -o f").flag("normalize"));
  EXPECT_FALSE(parse("build", "m -o f --normalize=false").flag("normalize"));
  EXPECT_THAT(complaint("build", "m -o f --normalize=maybe"), HasSubstr("expected true or false, found 'maybe'"));
}

TEST(Arguments, negativeNumbersAreValues) {
  const Arguments arguments = parse("render", "f -o x.png --camera -30,-20,1.5 --offset -0.1");
  EXPECT_EQ(arguments.numbers("camera"), (std::vector<double>{-30, -20, 1.5}));
  EXPECT_EQ(arguments.number("offset"), -0.1);
}

TEST(Arguments, domainIsAWordOrTwoCorners) {
  EXPECT_EQ(parse("build", "m -o f").text("domain"), "cube");
  EXPECT_EQ(parse("build", "m -o f --domain box").text("domain"), "box");
  EXPECT_EQ(parse("build", "m -o f --domain -1,-2,-3,1,2,3").numbers("domain"),
            (std::vector<double>{-1, -2, -3, 1, 2, 3}));
}

struct Mistake {
  const char* verb;
  const char* line;
  const char* message;
};

TEST(Arguments, mistakesNameTheExpectedValue) {
  const Mistake mistakes[] = {
      {"build", "m -o f --target-error 0", "--target-error: expected a number above 0, found '0'"},
      {"build", "m -o f --target-error -1e-6", "expected a number above 0, found '-1e-6'"},
      {"build", "m -o f --target-error nan", "expected a number above 0, found 'nan'"},
      {"build", "m -o f --target-error inf", "found 'inf'"},
      {"build", "m -o f --target-error 1e-6x", "found '1e-6x'"},
      {"build", "m -o f --nearness nan", "expected a number from 0 to 1000, found 'nan'"},
      {"build", "m -o f --max-bytes 1.5", "--max-bytes: expected a whole number from 1 to 1000000000000000, found"},
      {"build", "m -o f --max-bytes 1e30", "found '1e30'"},
      {"build", "m -o f --grid 0", "--grid: expected a whole number or 3 whole numbers"},
      {"build", "m -o f --grid 2,2", "found '2,2'"},
      {"build", "m -o f --grid 1.5", "found '1.5'"},
      {"build", "m -o f --max-degree 31", "--max-degree: expected a whole number from 1 to 30, found '31'"},
      {"build", "m -o f --max-degree 0", "found '0'"},
      {"build", "m -o f --max-depth 21", "from 0 to 20"},
      {"build", "m -o f --quadrature 9", "from 2 to 8"},
      {"build", "m -o f --continuity week", "did you mean 'weak'"},
      {"smooth", "f -o g --continuity-weight 0", "above 0"},
      {"smooth", "f -o g --continuity-weight 1e10", "found '1e10'"},
      {"study", "continuity m -o f --weights 1,,2",
       "--weights: expected 1 to 32 numbers with commas between them, each above 0, up to 1000000000, found '1,,2'"},
      {"build", "m -o f --domain 1,2,3", "cube, box or 6 numbers with commas between them, found '1,2,3'"},
      {"build", "m -o f --domain cub", "did you mean 'cube'?"},
      {"build", "m -o f --strategy ph", "expected hp, h1, h2, hpx or auto, found 'ph'"},
      {"build", "m -o f --continuity exakt", "did you mean 'exact'?"},
      {"build", "m -o f --blend-width 0", "above 0"},
      {"blend", "f -o g --width 0.3", "0.25, found '0.3'"},
      {"build", "m -o f --targt-error 1", "unknown option '--targt-error'; did you mean '--target-error'?"},
      {"build", "m -o f --targt-error=1", "unknown option '--targt-error'; did you mean '--target-error'?"},
      {"build", "m -o f --grid 2 --grid 3", "--grid: given 2 times"},
      {"build", "m -o", "-o: needs a value"},
      {"build", "m", "--output is missing"},
      {"build", "-o f", "mesh is missing"},
      {"build", "m --batch l -o f", "leave MESH out"},
      {"build", "m other -o f", "unexpected 'other'"},
      {"slice", "-o x.png", "field is missing"},
      {"slice", "f -o x.png --axis w", "expected x, y or z, found 'w'"},
      {"slice", "f -o x.png --size 100", "WIDTHxHEIGHT, each from 16 to 16384, found '100'"},
      {"slice", "f -o x.png --size 100x8", "found '100x8'"},
      {"slice", "f -o x.png --size 100x-80", "found '100x-80'"},
      {"slice", "f -o x.png --color dgree", "did you mean 'degree'?"},
      {"slice", "f -o x.png --offset nan", "expected a number, found 'nan'"},
      {"slice", "f -o x.png --samples 9", "from 1 to 8"},
      {"render", "f -o x.png --camera 1,2", "3 numbers with commas between them, found '1,2'"},
  };
  for (const Mistake& mistake : mistakes)
    EXPECT_THAT(complaint(mistake.verb, mistake.line), HasSubstr(mistake.message))
        << mistake.verb << " " << mistake.line;
}

TEST(Arguments, cameraAndPlaneAreChecked) {
  EXPECT_NO_THROW(surfacePicture(parse("render", "f -o x.png --camera 0,90,0.5")));
  EXPECT_THROW(surfacePicture(parse("render", "f -o x.png --camera 0,91,0.5")), Error);
  EXPECT_THROW(surfacePicture(parse("render", "f -o x.png --camera 0,0,0")), Error);
  EXPECT_NO_THROW(slicePicture(parse("slice", "f -o x.png --plane 0,0,0,1,1,0")));
  EXPECT_THROW(slicePicture(parse("slice", "f -o x.png --plane 0,0,0,1,1,0 --axis x")), Error);
}

TEST(Arguments, definePictures) {
  const auto slice =
      slicePicture(parse("slice", "f -o x.png --axis y --offset 0.5 --color distance --size 64x48 --samples 2"));
  ASSERT_TRUE(std::holds_alternative<render::AxisPlane>(slice.plane));
  EXPECT_EQ(std::get<render::AxisPlane>(slice.plane).axis, 1);
  EXPECT_EQ(std::get<render::AxisPlane>(slice.plane).offset, 0.5);
  EXPECT_EQ(slice.color, render::ColorBy::distance);
  EXPECT_EQ(slice.width, 64);
  EXPECT_EQ(slice.height, 48);
  EXPECT_EQ(slice.samples, 2);
  const auto surface = surfacePicture(parse("render", "f -o x.png --up z --color depth --offset 0.1"));
  EXPECT_EQ(surface.camera.up, render::UpAxis::z);
  EXPECT_EQ(surface.color, render::ColorBy::depth);
  EXPECT_EQ(surface.offset, 0.1);
  const render::OrbitCamera standard;
  EXPECT_EQ(surface.camera.azimuthDegrees, standard.azimuthDegrees);
  EXPECT_EQ(surface.camera.elevationDegrees, standard.elevationDegrees);
  EXPECT_EQ(surface.camera.distance, standard.distance);
}

TEST(DefaultOffset, isAShortNumberNearTheMiddle) {
  const auto offset = [](double low, double high) {
    return defaultOffset(Box(Vector3::Constant(low), Vector3::Constant(high)), 2);
  };
  EXPECT_EQ(offset(-1, 1), 0);
  EXPECT_FALSE(std::signbit(offset(-1, 0.99999)));
  EXPECT_EQ(offset(0, 1), 0.5);
  EXPECT_EQ(offset(0.0329874, 0.187321), 0.1102);
  EXPECT_EQ(offset(3e-7, 5.0008e-7), 4e-7);
  EXPECT_EQ(offset(0, 2.468013e9), 1.234e9);
  EXPECT_EQ(offset(0.125, 0.125), 0.125) << "a flat surface is met exactly";
}

TEST(Registry, unknownCommandNamesTheNearest) {
  const Registry registry = makeRegistry();
  try {
    registry.command("rendr");
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "unknown command 'rendr'; did you mean 'render'?");
  }
}

TEST(Registry, optionsHaveASecondSpelling) {
  EXPECT_TRUE(parse("build", "m -o f --outer-hull").flag("hull"));
  EXPECT_TRUE(parse("build", "m -o f --hull").flag("hull"));
  const Registry registry = makeRegistry();
  const auto script = parseScript(registry, "s", "build m output=f outer-hull=true", {});
  EXPECT_TRUE(script.front().arguments.flag("hull"));
  EXPECT_THAT(complaint("build", "m -o f --outer-hull --hull"), HasSubstr("given 2 times"));
}

TEST(Help, showsOptionsByGroupAndAdvancedOnesOnRequest) {
  const Registry registry = makeRegistry();
  const Command& build = registry.command("build");
  const std::string common = commandHelp(build, HelpDetail::common), all = commandHelp(build, HelpDetail::all);
  EXPECT_THAT(common, HasSubstr("\nWhat you ask for:\n  --tolerance NUMBER\n"));
  EXPECT_THAT(common, HasSubstr("--outer-hull"));
  EXPECT_EQ(common.find("--nearness-kind"), std::string::npos);
  EXPECT_THAT(common, HasSubstr("\n'hpsdf build --help-all' also explains "));
  EXPECT_THAT(all, HasSubstr("--nearness-kind"));
  EXPECT_EQ(all.find("--help-all"), std::string::npos);
  EXPECT_LT(all.find("\nThe paper's settings:\n"), all.find("\nGeneral:\n"));
}

TEST(Registry, unknownParametersAreAFaultOfTheProgram) {
  EXPECT_THROW(parse("info", "f").text("no-such-parameter"), std::logic_error);
}

TEST(Documentation, commandsPageIsUpToDate) {
  const auto page = std::filesystem::path(HPSDF_SOURCE_DIR) / "docs/commands.md";
  std::ifstream stream(page);
  ASSERT_TRUE(stream) << page;
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_TRUE(text.str() == commandsMarkdown(makeRegistry()))
      << "docs/commands.md is not up to date; write it with: hpsdf docs -o docs/commands.md";
}

}  // namespace registry_test
}  // namespace hpsdf::app
