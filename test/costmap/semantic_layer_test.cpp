// The layer for costmap_2d, loaded as a plugin into a stand-in of costmap_2d: it writes what the mapper's
// topics say, and only that.
#include <costmap_2d/GenericPluginConfig.h>
#include <costmap_2d/layer.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <class_loader/class_loader.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

constexpr unsigned char kUnknown = 255, kLethal = 254;

class SemanticLayerTest : public testing::Test {
 protected:
  SemanticLayerTest() {
    grids_ = node_.advertise<nav_msgs::OccupancyGrid>("projected_map", 1, true);
    updates_ = node_.advertise<map_msgs::OccupancyGridUpdate>("projected_map_updates", 10);
  }
  ~SemanticLayerTest() override {
    costmap_.reset();
    layer_.reset();
    ros::param::del("~layer");
  }

  /// A costmap of 10 m x 10 m around the origin, with the layer.
  void start(const std::string& frame = "map") {
    costmap_ = std::make_unique<costmap_2d::LayeredCostmap>(frame);
    layer_.reset(loader_.createUnmanagedInstance<costmap_2d::Layer>("bki_mapping::costmap::SemanticLayer"));
    layer_->initialize(costmap_.get(), "layer", &tf_);
    costmap_->addPlugin(layer_);
    costmap_->resizeMap(100, 100, 0.1, -5.0, -5.0);
    ASSERT_TRUE(soon([&] { return grids_.getNumSubscribers() == 1 && updates_.getNumSubscribers() == 1; }));
  }
  /// A grid of 4 m x 4 m around the origin, of one value.
  void publish(std::int8_t value) {
    nav_msgs::OccupancyGrid grid;
    grid.header.frame_id = "map";
    grid.header.stamp.fromSec(++seconds_);
    grid.info.resolution = 0.1f;
    grid.info.width = grid.info.height = 40;
    grid.info.origin.position.x = grid.info.origin.position.y = -2.0;
    grid.info.origin.orientation.w = 1.0;
    grid.data.assign(1600, value);
    grids_.publish(grid);
  }
  /// An update of the 0.5 m x 0.5 m at the corner with the least coordinates.
  void publishUpdate(std::int8_t value) {
    map_msgs::OccupancyGridUpdate update;
    update.header.frame_id = "map";
    update.header.stamp.fromSec(++seconds_);
    update.width = update.height = 5;
    update.data.assign(25, value);
    updates_.publish(update);
  }
  void place(double x) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "odom";
    transform.header.stamp.fromSec(++seconds_);
    transform.child_frame_id = "map";
    transform.transform.translation.x = x;
    transform.transform.rotation.w = 1.0;
    tf_.setTransform(transform, "test");
  }
  void enable(bool enabled) {
    dynamic_reconfigure::Reconfigure change;
    change.request.config.bools.resize(1);
    change.request.config.bools[0].name = "enabled";
    change.request.config.bools[0].value = enabled;
    ASSERT_TRUE(ros::service::call(ros::this_node::getName() + "/layer/set_parameters", change));
  }
  unsigned char costAt(double x, double y) { return costmap_->getCostmap()->costAt(x, y); }
  /// Whether the cost is at a place soon; updates the costmap meanwhile.
  bool becomes(unsigned char cost, double x, double y) {
    return soon([&] {
      cells_ = costmap_->updateMap();
      return costAt(x, y) == cost;
    });
  }
  static bool soon(const std::function<bool()>& condition) {
    for (int n = 0; n < 2000; ++n) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  ros::NodeHandle node_;
  ros::Publisher grids_, updates_;
  double seconds_ = 100.0;
  int cells_ = 0;  ///< of the last update
  tf2_ros::Buffer tf_{ros::Duration(1e6)};
  class_loader::ClassLoader loader_{BKI_MAPPING_LAYER};
  std::unique_ptr<costmap_2d::LayeredCostmap> costmap_;
  boost::shared_ptr<costmap_2d::Layer> layer_;
};

TEST_F(SemanticLayerTest, WritesTheGridAndItsUpdates) {
  start();
  costmap_->updateMap();
  EXPECT_FALSE(costmap_->isCurrent()) << "there is no grid yet";
  publish(30);
  ASSERT_TRUE(becomes(76, 0.0, 0.0));
  EXPECT_TRUE(costmap_->isCurrent());
  for (const double in : {-1.95, 1.95}) EXPECT_EQ(costAt(in, in), 76);
  for (const double out : {-2.05, 2.05, 4.0}) EXPECT_EQ(costAt(out, 0.0), kUnknown);
  EXPECT_GE(cells_, 1600);
  costmap_->updateMap();
  EXPECT_EQ(costmap_->updateMap(), 0) << "nothing has changed";
  publishUpdate(100);
  ASSERT_TRUE(becomes(kLethal, -1.95, -1.95));
  EXPECT_LE(cells_, 49) << "only what has changed is written";
  EXPECT_EQ(costAt(-1.55, -1.55), kLethal);
  EXPECT_EQ(costAt(-1.45, -1.45), 76);
}

TEST_F(SemanticLayerTest, WritesAllAnewInACostmapOfAnotherSize) {
  start();
  publish(0);
  ASSERT_TRUE(becomes(0, 1.0, 1.0));
  costmap_->resizeMap(40, 40, 0.2, -4.0, -4.0);
  EXPECT_EQ(costAt(1.0, 1.0), kUnknown);
  EXPECT_GE(costmap_->updateMap(), 400);
  EXPECT_EQ(costAt(1.0, 1.0), 0);
}

TEST_F(SemanticLayerTest, FollowsTheTransformAndKeepsTheLastOne) {
  start("odom");
  publish(60);
  EXPECT_TRUE(soon([&] { return costmap_->updateMap() == 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  costmap_->updateMap();
  EXPECT_EQ(costAt(0.0, 0.0), kUnknown);
  EXPECT_FALSE(costmap_->isCurrent()) << "tf knows nothing";
  place(2.0);
  ASSERT_TRUE(becomes(153, 3.5, 0.0));
  EXPECT_TRUE(costmap_->isCurrent());
  EXPECT_EQ(costAt(-0.5, 0.0), kUnknown);
  place(-2.0);
  ASSERT_TRUE(becomes(153, -3.5, 0.0));
  EXPECT_EQ(costAt(3.5, 0.0), kUnknown) << "what it wrote there is gone";
  tf_.clear();
  publishUpdate(100);
  ASSERT_TRUE(becomes(kLethal, -3.95, -1.95)) << "at the last transform";
  EXPECT_FALSE(costmap_->isCurrent());
}

TEST_F(SemanticLayerTest, TakesItsCostsBackWhenItIsDisabled) {
  start();
  publish(100);
  ASSERT_TRUE(becomes(kLethal, 0.0, 0.0));
  enable(false);
  ASSERT_TRUE(becomes(kUnknown, 0.0, 0.0));
  publish(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  costmap_->updateMap();
  EXPECT_EQ(costAt(0.0, 0.0), kUnknown);
  enable(true);
  EXPECT_TRUE(becomes(0, 0.0, 0.0)) << "the grid came while it was disabled";
}

TEST_F(SemanticLayerTest, RefusesAnUnknownMethod) {
  ros::NodeHandle("~/layer").setParam("combination_method", 2);
  costmap_ = std::make_unique<costmap_2d::LayeredCostmap>("map");
  layer_.reset(loader_.createUnmanagedInstance<costmap_2d::Layer>("bki_mapping::costmap::SemanticLayer"));
  try {
    layer_->initialize(costmap_.get(), "layer", &tf_);
    FAIL() << "it took the method";
  } catch (const std::invalid_argument& fault) {
    EXPECT_STREQ(fault.what(), "layer/combination_method is 2; known methods: 0 (overwrite), 1 (maximum)");
  }
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "semantic_layer_test");
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
