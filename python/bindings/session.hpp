#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "call.hpp"
#include "palpate/device.hpp"

namespace palpate::python {

/// An open device that the objects made on it share and keep open. One thread at a time works on
/// it: the others wait.
class Session {
 public:
  explicit Session(Device device) : device_(std::move(device)) {}

  /// Holds the device for one thread.
  class Lock {
   public:
    Lock(Session& session, const Call& call);
    ~Lock();
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    Device& device() { return session_.device_; }

   private:
    Session& session_;
  };

  /// Waits until no other thread works on the device; throws where the call is given up meanwhile.
  Lock lock(const Call& call) { return {*this, call}; }
  /// For long work on the device: throws where the call that holds the device is given up.
  void check() const { working_call_->check(); }
  /// Destroys an object of the device now or, where a thread works on the device, after that.
  void destroy(std::shared_ptr<void> object);

  const std::string& name() const { return device_.name(); }
  std::uint64_t memory_bytes() const { return device_.memory_bytes(); }

 private:
  void sweep();
  void sweep_unlocked();
  bool swept();

  OwnProcess process_;
  Device device_;
  std::timed_mutex working_;
  const Call* working_call_ = nullptr;  ///< of the thread that holds working_
  std::mutex sweeping_;
  std::vector<std::shared_ptr<void>> unwanted_;
};

/// An object of a device: keeps it open, and is destroyed while no thread works on the device.
template <typename Object>
class Owned {
 public:
  Owned(const std::shared_ptr<Session>& session, Object object)
      : session_(session), object_(new Object(std::move(object)), [session](Object* unwanted) {
          session->destroy(std::shared_ptr<Object>(unwanted));
        }) {}

  /// Runs `work(object, call)` on the device, as run() does.
  template <typename F>
  auto use(std::vector<nb::object> kept, const Progress& progress, F work) const {
    return run(std::move(kept), progress,
               [session = session_, object = object_, work = std::move(work)](Call& call) {
                 const auto lock = session->lock(call);
                 return work(*object, call);
               });
  }
  template <typename F>
  auto use(F work) const {
    return use({}, Progress(), std::move(work));
  }

  /// For what never changes, which may be read without the lock.
  const Object& constant() const { return *object_; }
  const Session& session() const { return *session_; }

 private:
  std::shared_ptr<Session> session_;
  std::shared_ptr<Object> object_;
};

/// Makes an object on the device: `make(device)` as run() runs it.
template <typename Object, typename F>
Owned<Object> make_owned(const std::shared_ptr<Session>& session, F make) {
  return run([session, make = std::move(make)](Call& call) {
    auto lock = session->lock(call);
    return Owned<Object>(session, make(lock.device()));
  });
}

/// A method of an object that a class of Python owns, as a function of that class: it runs on the
/// device, by use().
template <typename Held, typename Object, typename Value, typename... Arguments>
auto on_device(Value (Object::*method)(Arguments...)) {
  return [method](const Held& self, std::decay_t<Arguments>... arguments) {
    return self.use([=](Object& object, Call&) { return (object.*method)(arguments...); });
  };
}
template <typename Held, typename Object, typename Value, typename... Arguments>
auto on_device(Value (Object::*method)(Arguments...) const) {
  return [method](const Held& self, std::decay_t<Arguments>... arguments) {
    return self.use([=](const Object& object, Call&) { return (object.*method)(arguments...); });
  };
}

}  // namespace palpate::python
