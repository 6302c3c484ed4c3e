#include "recognition/live_recognition.hpp"

#include <memory>

#include <gtest/gtest.h>

#include "palpate/virtual_sensor.hpp"
#include "shapes.hpp"

namespace palpate::live_recognition_test {

TEST(LiveRecognition, BelievesOfAStreamWhatRecogniseDoesOfItsTouches) {
  const RecognitionTask task(shapes(), every_filter()[0]);
  Recogniser recogniser(shared_device(), task);
  const std::unique_ptr<Sensor> sensor =
      open_virtual_sensor("simulate:L,touches=4,speed=max,object=1:-2:40,seed=3");
  std::vector<LiveTouch> touches;
  LiveRecognition live(*sensor, sensor->description().elements_mm, recogniser, task, {},
                       [&](const LiveTouch& touch) { touches.push_back(touch); });
  while (!live.wait_for_end(std::chrono::milliseconds(100))) {
  }
  live.finish();
  ASSERT_EQ(touches.size(), 4U);
  EXPECT_EQ(live.state().all_touches, 4U);
  EXPECT_EQ(live.latencies_ms().size(), 4U);

  const SensorDescription& description = sensor->description();
  Query unknown{.recording = "stream",
                .truth = partial_truth(description.object, description.truth)};
  for (const LiveTouch& touch : touches) {
    unknown.touches.push_back({.T_robot_sensor = *touch.touch.T_robot_sensor,
                               .elements_mm = description.elements_mm,
                               .pressure = touch.touch.pressure,
                               .valid = touch.touch.valid});
  }
  const RecognitionRecord record = recognise(recogniser, task, unknown, true);
  ASSERT_EQ(record.error, "");
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const RecognitionStep& step = touches[i].step;
    EXPECT_EQ(touches[i].index, i);
    EXPECT_EQ(step.right, record.trace[i].right);
    // A touch evaluated ahead is added in one step: float32 rounds it by some 1e-5 nats.
    EXPECT_NEAR(step.identity[0], record.trace[i].identity[0], 1e-4);
    EXPECT_EQ(step.mode.bin, record.trace[i].mode.bin);
    EXPECT_EQ(step.error_mm.has_value(), record.trace[i].error_mm.has_value());
  }
}

}  // namespace palpate::live_recognition_test
