#include <algorithm>
#include <map>

#include "cli/map_flags.hpp"
#include "cli/options.hpp"
#include "learning/press.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

void require_two_groups(const MapFlags& flags, const std::string& label,
                        const std::vector<TouchSource>& sources) {
  const auto as_first = [&](const TouchSource& source) {
    return source.group == sources.front().group;
  };
  if (!flags.group.empty() && !sources.empty() && std::ranges::all_of(sources, as_first)) {
    refuse_flag("--group", flags.group,
                "all touches of '{}' are of '{}': none are left to learn from without them; give "
                "touches of two groups or more of each object",
                label, sources.front().group);
  }
}

}  // namespace

GroupedTouches group_by_label(const MapFlags& flags, const std::vector<Recording>& recordings,
                              const ContactClassifier& classifier) {
  const Pose T_object_robot = inverse(object_origin(flags).T_learned_robot_object);
  struct Group {
    std::vector<Touch> touches;
    std::vector<TouchSource> sources;
  };
  std::map<std::string, Group> groups;
  for (const Recording& recording : recordings) {
    const auto [object, own_group] = grouped_object(recording, flags.group);
    const std::string& label = flags.label.empty() ? object : flags.label;
    require_name(recording.path, label);
    const auto [begin, end] = selected_touches(recording, flags.request.frames);
    Group& group = groups[label];
    for (std::size_t i = begin; i < end; ++i) {
      Touch touch = recording.touch(i);
      touch.T_robot_sensor = flags.unposed ? Pose{} : T_object_robot * touch.T_robot_sensor;
      if (const auto fault = fault_of(known_readings(touch, classifier))) {
        refuse(recording.path, "sensor_pose[{}]: {}", i, *fault);
      }
      group.touches.push_back(touch);
      group.sources.push_back({recording.path, i, own_group});
    }
    if (!flags.to_folder() && groups.size() > 1) {
      refuse(recording.path,
             "object '{}' differs from '{}' of {}; write a map of each object with -o {}/, or one "
             "map of all touches with --label",
             label, recordings.front().object, recordings.front().path, flags.output);
    }
  }
  GroupedTouches result;
  std::vector<std::string> labels;
  for (auto& [label, group] : groups) {
    require_two_groups(flags, label, group.sources);
    labels.push_back(label);
    result.objects.push_back({label, std::move(group.touches)});
    result.sources.push_back(std::move(group.sources));
  }
  require_known_symmetries(flags, labels);
  return result;
}

}  // namespace palpate::cli
