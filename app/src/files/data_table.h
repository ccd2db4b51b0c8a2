#pragma once
// Reads raw values from .csv and .pfm files that commands of the program have written, and compares them.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace hpsdf::app {

struct DataTable {
  std::string header = {};  ///< first line of a .csv file if it holds column names, otherwise ""
  std::size_t columns = 0;
  std::size_t rows = 0;  ///< number of rows; in a .pfm file the first row is the lowest
  std::vector<double> values = {};
};

bool isDataFile(const std::filesystem::path& file);

/// Reads a .pfm file with one channel or a .csv file of numbers. The first line of a .csv file may hold column names.
/// The word "exact" in a .csv file, the degree of an exact leaf, is read as `kExactDegree`, as in a .pfm file.
/// Throws `Error` naming the file.
DataTable loadData(const std::filesystem::path& file);

struct DataDifference {
  std::size_t row;
  std::size_t column;
  double baseline;
  double actual;
  double difference;  ///< |actual − baseline|; infinite where only one of the values is a number
};

struct DataComparison {
  bool sameShape = false;     ///< true if the numbers of rows and the column names agree
  std::size_t compared = 0;   ///< number of compared values
  std::size_t differing = 0;  ///< number of values that differ by more than the accepted bound
  double largest = 0;
  std::vector<DataDifference> worst = {};  ///< largest differences in descending order, at most `kWorstData`
};

/// Default bound for the difference between two values: about eight times the spacing of floats just above 1.
constexpr double kDataBound = 1e-6;
constexpr std::size_t kWorstData = 10;

DataComparison compare(const DataTable& baseline, const DataTable& actual, double bound);

/// Returns one line that says why a comparison failed. Returns "" if the two tables have the same shape and at most
/// the share `budget` of the values differs.
std::string problem(const DataComparison& comparison, double bound, double budget);

}  // namespace hpsdf::app
