#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

#include "call.hpp"
#include "model/own_process.hpp"
#include "palpate/device.hpp"
#include "palpate/error.hpp"

namespace palpate::python {

/// An object whose work one thread of Python at a time runs, without the GIL: the others wait. It
/// keeps its device open. A child of fork() is refused, and leaves its copy of the object alone.
template <typename Object>
class Shared {
 public:
  /// @param name what the object stands on, for messages: "device"
  /// @param device may be null
  Shared(const char* name, std::shared_ptr<Device> device, Object object)
      : name_(name), held_(new Held{std::move(device), std::move(object)}) {}

  /// Runs `work(object, report)`, as run() does.
  template <typename F>
  auto use(const Progress& progress, F work) const {
    Held& held = held_here(held_, name_);
    return run(progress, [&](const Report& report) {
      const ExclusiveUse use(held);
      return work(held.object, report);
    });
  }
  /// Runs `work(object)`.
  template <typename F>
  auto use(F work) const {
    return use(Progress(), [&](Object& object, const Report&) { return work(object); });
  }

  /// For what never changes, which may be read while another thread works.
  const Object& constant() const { return held_->object; }
  /// The object's device, where it has one.
  const Device& device() const { return *held_->device; }

 private:
  struct Held {
    std::shared_ptr<Device> device;
    Object object;
    OwnProcess process = {};
    std::timed_mutex mutex = {};
    std::atomic<std::thread::id> worker = {};  ///< the thread whose turn it is
  };

  class ExclusiveUse {
   public:
    explicit ExclusiveUse(Held& held) : held_(held) {
      if (held.worker == std::this_thread::get_id()) {
        throw Error(Fault::input,
                    "progress: uses the object whose progress it is; wait for the "
                    "end of the call");
      }
      while (!held.mutex.try_lock_for(std::chrono::milliseconds(20))) {
        check_signals();
        if (calls_are_held()) {
          throw Error(Fault::input,
                      "a call of a daemon thread keeps this object, and stopped for good as the "
                      "interpreter ended; let the thread end before");
        }
      }
      held.worker = std::this_thread::get_id();
    }
    ~ExclusiveUse() {
      held_.worker = std::thread::id();
      held_.mutex.unlock();
    }
    ExclusiveUse(const ExclusiveUse&) = delete;
    ExclusiveUse& operator=(const ExclusiveUse&) = delete;

   private:
    Held& held_;
  };

  struct Deleter {
    void operator()(Held* held) const { delete_here(held); }
  };

  const char* name_;
  std::unique_ptr<Held, Deleter> held_;
};

/// Makes an object on the device, by `make(device)`, without the GIL.
template <typename F>
auto make_shared_on(const std::shared_ptr<Device>& device, F make) {
  return run([&] { return Shared("device", device, make(*device)); });
}

/// A method of an object that a class of Python shares, as a function of that class.
template <typename Held, typename Object, typename Value, typename... Arguments>
auto shared_method(Value (Object::*method)(Arguments...)) {
  return [method](const Held& self, std::decay_t<Arguments>... arguments) {
    return self.use([&](Object& object) { return (object.*method)(arguments...); });
  };
}
template <typename Held, typename Object, typename Value, typename... Arguments>
auto shared_method(Value (Object::*method)(Arguments...) const) {
  return [method](const Held& self, std::decay_t<Arguments>... arguments) {
    return self.use([&](const Object& object) { return (object.*method)(arguments...); });
  };
}

}  // namespace palpate::python
