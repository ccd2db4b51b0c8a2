// Tests that README shows the program that the consumer test builds, and that its links lead to existing files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace readme_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kRoot = HPSDF_SOURCE_DIR;

std::string read(const fs::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_TRUE(stream.good()) << file;
  return text.str();
}

TEST(Readme, showsTheProgramThatTheConsumerTestRuns) {
  EXPECT_THAT(read(kRoot / "README.md"), HasSubstr("```cpp\n" + read(kRoot / "tests/consumer/use_core.cpp") + "```"));
}

TEST(Readme, linksToFilesThatExist) {
  const std::string text = read(kRoot / "README.md");
  static const std::regex link(R"(\]\(([^)#]+)\))");
  std::size_t links = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at, ++links)
    EXPECT_TRUE(fs::exists(kRoot / (*at)[1].str())) << (*at)[1];
  EXPECT_GT(links, 10u);
}

}  // namespace readme_test
