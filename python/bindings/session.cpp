#include "session.hpp"

namespace palpate::python {

using namespace std::chrono_literals;

Session::Lock::Lock(Session& session, const Call& call) : session_(session) {
  session.device_.context();  // throws in a child of fork(), where no thread may unlock it
  while (!session_.working_.try_lock_for(20ms)) {
    call.check();
  }
  session_.working_call_ = &call;
}

Session::Lock::~Lock() {
  session_.sweep();
  session_.working_.unlock();
  session_.sweep_unlocked();  // what came after the sweep found the device locked
}

void Session::sweep() {
  std::vector<std::shared_ptr<void>> unwanted;
  {
    const std::lock_guard lock(sweeping_);
    unwanted.swap(unwanted_);
  }
}

bool Session::swept() {
  const std::lock_guard lock(sweeping_);
  return unwanted_.empty();
}

void Session::sweep_unlocked() {
  while (!swept() && working_.try_lock()) {
    sweep();
    working_.unlock();
  }
}

void Session::destroy(std::shared_ptr<void> object) {
  if (!process_.is_here()) {
    return;  // the object's destructor leaves all to the parent, whose threads hold locks
  }
  {
    const std::lock_guard lock(sweeping_);
    unwanted_.push_back(std::move(object));
  }
  sweep_unlocked();
}

}  // namespace palpate::python
