// Part of core where it is built with ThreadSanitizer. Debian's oneTBB is not, so that ThreadSanitizer sees neither
// that a task comes after what its spawner did, nor that who waits comes after the tasks, and takes all that tasks
// touch for races. Here are the functions of oneTBB's library that its headers hand tasks over with: each tells
// ThreadSanitizer of the order that it makes and calls the library's own.

#include <dlfcn.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>
#include <sanitizer/tsan_interface.h>

#include <cstdlib>
#include <new>

namespace tbb::detail {
namespace {

/// The library's function that the one of the same `symbol` here stands in front of.
template <typename Function>
Function* libraryOwn(const char* symbol) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, symbol));
}

/// Is spawned in place of a task, and orders it behind its spawner.
class Ordered : public d1::task {
 public:
  explicit Ordered(d1::task& of) : task_(of) { __tsan_release(this); }

  d1::task* execute(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* next = task_.execute(data);  // where that throws, cancel() follows
    delete this;
    return next;
  }
  d1::task* cancel(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* next = task_.cancel(data);
    delete this;
    return next;
  }

  // not by `new`: tests count what our code takes
  static void* operator new(std::size_t size) { return std::aligned_alloc(alignof(d1::task), size); }
  static void operator delete(void* memory) { std::free(memory); }

 private:
  ~Ordered() override = default;

  d1::task& task_;
};

/// What an arena executes, maybe in a thread of its own.
class OrderedDelegate : public d1::delegate_base {
 public:
  explicit OrderedDelegate(d1::delegate_base& delegate) : delegate_(delegate) { __tsan_release(&delegate_); }

  bool operator()() const override {
    __tsan_acquire(&delegate_);
    const bool more = delegate_();
    __tsan_release(&delegate_);
    return more;
  }

 private:
  d1::delegate_base& delegate_;
};

/// At its end, by an exception too, its thread comes behind all that the tasks it waited for did.
class BehindTasks {
 public:
  explicit BehindTasks(d1::wait_context& waited) : waited_(waited) {}
  BehindTasks(const BehindTasks&) = delete;
  ~BehindTasks() { waited_.reserve(0); }  // the tasks released this counter; to add nothing acquires it

 private:
  d1::wait_context& waited_;
};

}  // namespace

namespace r1 {

void spawn(d1::task& task, d1::task_group_context& context) {
  static const auto own = libraryOwn<void(d1::task&, d1::task_group_context&)>(
      "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextE");
  own(*new Ordered(task), context);
}

void spawn(d1::task& task, d1::task_group_context& context, d1::slot_id slot) {
  static const auto own = libraryOwn<void(d1::task&, d1::task_group_context&, d1::slot_id)>(
      "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextEt");
  own(*new Ordered(task), context, slot);
}

void execute_and_wait(d1::task& task, d1::task_group_context& ofTask, d1::wait_context& waited,
                      d1::task_group_context& ofWait) {
  static const auto own =
      libraryOwn<void(d1::task&, d1::task_group_context&, d1::wait_context&, d1::task_group_context&)>(
          "_ZN3tbb6detail2r116execute_and_waitERNS0_2d14taskERNS2_18task_group_contextERNS2_12wait_contextES6_");
  const BehindTasks behind(waited);
  own(task, ofTask, waited, ofWait);
}

void wait(d1::wait_context& waited, d1::task_group_context& context) {
  static const auto own = libraryOwn<void(d1::wait_context&, d1::task_group_context&)>(
      "_ZN3tbb6detail2r14waitERNS0_2d112wait_contextERNS2_18task_group_contextE");
  const BehindTasks behind(waited);
  own(waited, context);
}

void execute(d1::task_arena_base& arena, d1::delegate_base& delegate) {
  static const auto own = libraryOwn<void(d1::task_arena_base&, d1::delegate_base&)>(
      "_ZN3tbb6detail2r17executeERNS0_2d115task_arena_baseERNS2_13delegate_baseE");
  OrderedDelegate ordered(delegate);
  own(arena, ordered);
  __tsan_acquire(&delegate);
}

// the memory of a task goes from thread to thread
void* allocate(d1::small_object_pool*& pool, std::size_t size) {
  static const auto own = libraryOwn<void*(d1::small_object_pool*&, std::size_t)>(
      "_ZN3tbb6detail2r18allocateERPNS0_2d117small_object_poolEm");
  void* memory = own(pool, size);
  __tsan_acquire(memory);
  return memory;
}

void* allocate(d1::small_object_pool*& pool, std::size_t size, const d1::execution_data& data) {
  static const auto own = libraryOwn<void*(d1::small_object_pool*&, std::size_t, const d1::execution_data&)>(
      "_ZN3tbb6detail2r18allocateERPNS0_2d117small_object_poolEmRKNS2_14execution_dataE");
  void* memory = own(pool, size, data);
  __tsan_acquire(memory);
  return memory;
}

void deallocate(d1::small_object_pool& pool, void* memory, std::size_t size) {
  static const auto own = libraryOwn<void(d1::small_object_pool&, void*, std::size_t)>(
      "_ZN3tbb6detail2r110deallocateERNS0_2d117small_object_poolEPvm");
  __tsan_release(memory);
  own(pool, memory, size);
}

void deallocate(d1::small_object_pool& pool, void* memory, std::size_t size, const d1::execution_data& data) {
  static const auto own = libraryOwn<void(d1::small_object_pool&, void*, std::size_t, const d1::execution_data&)>(
      "_ZN3tbb6detail2r110deallocateERNS0_2d117small_object_poolEPvmRKNS2_14execution_dataE");
  __tsan_release(memory);
  own(pool, memory, size, data);
}

}  // namespace r1
}  // namespace tbb::detail
