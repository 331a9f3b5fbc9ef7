// What the node says of an input: each sentence once, and again when settings have changed.
#include "ros/input_notes.h"

#include <gtest/gtest.h>

#include <string>

namespace bki_mapping::ros_interface {
namespace {

/// All that may be said of a cloud of `/points`, as one text.
std::string allOf(InputNotes& notes) {
  SemanticClass car;
  car.name = "car";
  car.raw = {10};
  PlacedScan placed;
  placed.scan.labels = {10, 7};
  placed.unlisted_labels.add(7);
  PointCounts counts;
  counts.points = 2;
  counts.labels_not_in_table = 1;
  return notes.ofOrigin(true, "map") + notes.ofFarPoints(3, InputConfig()) +
         notes.ofLabels(placed, counts, InputConfig(), ClassTable("t", {car}), MapperConfig()) +
         notes.ofTimes("as seconds") + notes.ofNoDirection(NoDirection::kUnorganised, 5);
}

TEST(InputNotes, AreSaidOnceWhileTheSettingsStay) {
  InputNotes notes("/points");
  const std::string first = allOf(notes);
  for (const char* words :
       {"Clouds of /points are in the map frame 'map'", "3 points of a cloud of /points are farther",
        "50 % of the points of a scan", "Times of points of /points are read as seconds",
        "5 beams without a return in a cloud of /points clear nothing"}) {
    EXPECT_NE(first.find(words), std::string::npos) << words << ": " << first;
  }
  EXPECT_NE(notes.labelRemedy(), "");
  EXPECT_EQ(allOf(notes), "");
  EXPECT_NE(notes.ofNoDirection(NoDirection::kNoRings, 1), "") << "another reason";
  EXPECT_NE(notes.ofTimes("as nanoseconds"), "");
  notes.restart();
  EXPECT_EQ(allOf(notes), first) << "all of it, whatever has changed";
}

TEST(InputNotes, AreNotSaidOfInputsInOrder) {
  InputNotes notes("/points");
  InputConfig input;
  input.sensor_model.max_range = 50.0;
  EXPECT_EQ(notes.ofOrigin(false, "map") + notes.ofFarPoints(0, InputConfig()) + notes.ofFarPoints(3, input) +
                notes.ofTimes("") + notes.ofNoDirection(NoDirection::kUnorganised, 0),
            "");
  EXPECT_NE(notes.ofFarPoints(3, InputConfig()), "") << "nothing was said before";
}

}  // namespace
}  // namespace bki_mapping::ros_interface
