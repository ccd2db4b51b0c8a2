#pragma once
// Raw values that commands write, read back to be compared: .csv and .pfm.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace hpsdf::app {

struct DataTable {
  std::string header = {};  ///< names of the columns; "" where there are none
  std::size_t columns = 0;
  std::size_t rows = 0;  ///< of a .pfm: bottom to top, as they lie in the file
  std::vector<double> values = {};
};

bool isDataFile(const std::filesystem::path& file);

/// Numbers separated by commas, a row a line, with or without names in the first; or a portable float map of one
/// channel. Throws `Error` naming the file.
DataTable loadData(const std::filesystem::path& file);

struct DataDifference {
  std::size_t row;
  std::size_t column;
  double baseline;
  double actual;
  double difference;  ///< infinite where only one of them is a number
};

struct DataComparison {
  bool sameShape = false;     ///< as many rows, and columns of the same names
  std::size_t compared = 0;   ///< values
  std::size_t differing = 0;  ///< by more than the bound
  double largest = 0;
  std::vector<DataDifference> worst = {};  ///< the worst first, `kWorstData` at most
};

/// How much a value may differ: two or three low bits of a float near 1.
constexpr double kDataBound = 1e-6;
constexpr std::size_t kWorstData = 10;

DataComparison compare(const DataTable& baseline, const DataTable& actual, double bound);

/// What is wrong, in one line; empty where the shape is the same and at most a share of `budget` of the values differs.
std::string problem(const DataComparison& comparison, double bound, double budget);

}  // namespace hpsdf::app
