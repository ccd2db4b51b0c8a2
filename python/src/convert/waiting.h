#pragma once
// Work of the library that Python waits for: without the interpreter's lock (GIL), with progress and with Ctrl-C.

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::python {

/// Does `work` in a thread of its own while the calling thread waits, without the GIL. The waiting thread calls
/// `progress(task, fraction)`, unless it is None, up to twenty times a second, and looks as often whether a signal
/// came. If `progress` is True, a bar on standard error shows it.
/// An exception of a signal's handler, such as KeyboardInterrupt after Ctrl-C, or of `progress` cancels the work
/// and is rethrown when it has ended. Rethrows exceptions of `work`.
void waitFor(const pybind11::object& progress, const std::function<void(const Progress&)>& work);

/// Returns the result of `work`, which is done as by `waitFor`.
template <typename Work>
auto resultOf(const pybind11::object& progress, const Work& work) {
  std::optional<decltype(work(Progress{}))> result;
  waitFor(progress, [&](const Progress& link) { result.emplace(work(link)); });
  return std::move(*result);
}

/// Calls `work(first item, number of items)` for successive pieces of `size` items, without the GIL, and looks after
/// each piece whether a signal came.
template <typename Work>
void forEachPiece(std::size_t items, std::size_t size, const Work& work) {
  for (std::size_t first = 0; first < items; first += size) {
    {
      const pybind11::gil_scoped_release released;
      work(first, std::min(size, items - first));
    }
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
  }
}

}  // namespace hpsdf::python
