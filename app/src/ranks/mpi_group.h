#pragma once
// The processes of an MPI program, as the program's process group.

#include <functional>

namespace hpsdf::app {

struct ProcessGroup;

/// Calls `work` with the processes that mpirun has started together with this one, and returns what it returns. MPI is
/// initialized meanwhile. Throws `Error` if this program was built without MPI, or if MPI cannot be used.
int withProcessGroup(const std::function<int(ProcessGroup&)>& work);

}  // namespace hpsdf::app
