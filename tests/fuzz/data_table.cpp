// Fuzz target: raw values that `hpsdf check` compares, as .pfm if the input begins with "P", else as .csv. They form a
// full table of rows and columns, which equals itself.
#include "files/data_table.h"

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hpsdf;
  const std::string_view bytes = fuzz::textOf(data, size);
  const auto file = fuzz::fileOf(bytes.starts_with('P') ? "in.pfm" : "in.csv", bytes);
  fuzz::reads([&] {
    const app::DataTable table = app::loadData(file);
    if (table.rows > 0)
      fuzz::require(table.values.size() / table.rows == table.columns && table.values.size() % table.rows == 0,
                    "as many values as rows times columns");
    fuzz::require(table.rows > 0 || table.values.empty(), "no values without rows");
    const app::DataComparison same = app::compare(table, table, 0);
    fuzz::require(same.sameShape && same.differing == 0, "a table equals itself");
  });
  return 0;
}
