#pragma once
// The processes that mpirun has started together.

#include <exception>
#include <memory>

#include "hpsdf/parallel/ranks.h"

namespace hpsdf::app {

/// Processes that build one field together. Rank 0 reads the arguments, reports and writes the field as a process alone
/// does; the others only help it.
struct ProcessGroup {
  std::unique_ptr<Ranks> ranks;
  bool hasBegun = false;  ///< the construction has begun, which tells all of them if one fails

  bool isFirst() const { return ranks->rank() == 0; }
};

/// Returns true if a program such as mpirun has started this process and others together. MPI need not have been
/// initialized.
bool isStartedTogether();

/// Thrown by a process that has done its part of a field, which rank 0 alone has.
class PartDone : public std::exception {
 public:
  const char* what() const noexcept override { return "rank 0 has the field"; }
};

}  // namespace hpsdf::app
