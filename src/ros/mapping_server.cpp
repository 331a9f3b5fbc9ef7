#include "ros/mapping_server.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "ros/cloud_frame.h"
#include "ros/map_cloud.h"
#include "ros/map_file_settings.h"
#include "ros/pose_conversion.h"
#include "ros/queued_call.h"
#include "ros/start_server.h"

namespace bki_mapping::ros_interface {
namespace {

/// How long the thread waits for a callback [s]: with an empty queue, and while clouds wait for transforms.
constexpr double kScanWait = 0.1, kTransformWait = 0.005;
/// What takes time is done right after a scan if none waits, so that the next one does not wait for it; or at
/// any time when it could not be for as long as this.
constexpr auto kNoTimeAtMost = std::chrono::milliseconds(300);

}  // namespace

MappingServer::MappingServer(ros::NodeHandle node, ros::NodeHandle private_node)
    : node_(std::move(node)), private_node_(std::move(private_node)) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  MapperConfig mapper_config;
  readParameters(private_node_, config_, mapper_config);
  mapper_ = std::make_unique<SemanticMapper>(
      mapper_config, std::make_shared<const ClassTable>(loadClassTable(config_.classes)));
  obstaclesOf(config_.distance_section, mapper_->classes());  // refuses names that the table lacks
  const ClassTable& table = mapper_->classes();
  if (!config_.config.empty()) {
    ROS_INFO("Settings: config %s, for class table '%s'%s", config_.config.c_str(), table.name().c_str(),
             table.saysWhatMoves() ? "" : ", in which no class can move");
  }
  for (const std::string& warning : settingWarnings(mapper_config, table)) ROS_WARN("%s", warning.c_str());
  kept_ =
      std::make_unique<KeptMap>(*mapper_, config_, private_node_.getNamespace(), [this] { wake(queue_); });

  poses_ = std::make_unique<PoseSource>(node_);
  if (kept_->corrector()) {
    corrected_ = std::make_unique<CorrectedPoses>(node_, config_, *poses_, *kept_->corrector(), [this] {
      trajectory_.correct(kept_->corrector()->trajectory());
      status_publisher_.publish(status());
    });
  }
  publishing_ = std::make_unique<PublisherSet>(node_, config_, [this] {
    return QueuedCall<std::shared_ptr<const ServerSnapshot>>::ask(queue_, [this] {
      publishing_->closeChanges();
      return std::make_shared<const ServerSnapshot>(snapshot());
    });
  });
  status_publisher_ = private_node_.advertise<MappingStatus>("status", 10, true);
  diagnostics_ = std::make_unique<MappingDiagnostics>(node_, private_node_, config_.diagnostic_period);
  queries_ = std::make_unique<QueryServices>(private_node_, queue_, [this](const QueriedMap* earlier) {
    const ClassTable& classes = mapper_->classes();
    return earlier ? std::make_shared<const QueriedMap>(mapHeader(), mapper_->snapshot(), classes, *earlier)
                   : std::make_shared<const QueriedMap>(mapHeader(), mapper_->snapshot(), classes);
  });
  offerServices();
  if (!kept_->readOnly()) subscribe();
  live_settings_ = std::make_unique<LiveSettings>(
      private_node_, config_, mapper_->config(),
      [this](const ServerConfig& server, const MapperConfig& mapper) { applySettings(server, mapper); },
      [this] { status_publisher_.publish(status()); });
  status_publisher_.publish(status());
  thread_ = std::thread(&MappingServer::work, this);
  publishing_->start();
  saving_.start();
  queries_->start();
  if (mapper_->map().size() > 0) publishing_->startOver();
}

MappingServer::~MappingServer() {
  // First the threads that request snapshots, while the mapping thread still answers.
  saving_.stop();
  queries_->stop();
  publishing_->stop();
  running_ = false;
  thread_.join();
  const auto say = [&](const std::string& sentence) {
    if (ros::isShuttingDown()) {  // rosconsole is already closed
      std::printf("%s: %s\n", private_node_.getNamespace().c_str(), sentence.c_str());
      std::fflush(stdout);
    } else {
      ROS_INFO("%s", sentence.c_str());
    }
  };
  say(ledger_.summary(waiting_.size()));
  if (corrected_ && !corrected_->summary().empty()) say(corrected_->summary());
  if (!kept_->hasFile()) return;
  const std::string lost = kept_->close();
  say(lost.empty() ? "The map is saved in " + kept_->filePath() : lost);
}

ScanReader MappingServer::readerOf(const InputConfig& input) const {
  return {input, config_.frame_id, mapper_->classes(), mapper_->config().label_values,
          corrected_ ? ScanAxes::kSensor : ScanAxes::kMap};
}

void MappingServer::subscribe() {
  for (const InputConfig& input : allInputs(config_, mapper_->config())) {
    const std::size_t number = readers_.size();
    readers_.push_back(readerOf(input));
    // Queue size 0: no limit. waiting_ is the queue that drops clouds, because it counts them.
    const boost::function<void(const CloudEvent&)> call = [this, number](const CloudEvent& event) {
      onCloud(number, event);
    };
    cloud_subscribers_.push_back(node_.subscribe<sensor_msgs::PointCloud2>(input.topic, 0, call));
    ROS_INFO("Mapping %s into frame '%s' with free_space/mode %s, %g m voxels",
             cloud_subscribers_.back().getTopic().c_str(), config_.frame_id.c_str(),
             mapper_->config().free_space.mode.c_str(), mapper_->config().resolution);
    notes_.emplace_back(cloud_subscribers_.back().getTopic());
    const std::string unlabelled = notes_.back().ofSettings(input, mapper_->classes());
    if (!unlabelled.empty()) ROS_WARN("%s", unlabelled.c_str());
  }
  points_.resize(readers_.size());
}

void MappingServer::applySettings(const ServerConfig& server, const MapperConfig& mapper) {
  checkMapFileSettings(server);
  if (kept_->corrector()) MapCorrector::checkCorrectable(mapper);
  mapper_->reconfigure(mapper);
  if (kept_->corrector()) kept_->corrector()->reconfigure(mapper);
  config_ = server;
  const std::vector<InputConfig> inputs = allInputs(config_, mapper_->config());
  readers_.clear();
  for (const InputConfig& input : inputs) {
    readers_.push_back(readerOf(input));
  }
  for (InputNotes& notes : notes_) notes.restart();
  wholeMapChanged();
}

void MappingServer::work() {
  while (running_) {
    queue_.callOne(ros::WallDuration(waiting_.size() == 0 ? kScanWait : kTransformWait));
    handleMessages();
    checkClock();
    reportTfJumps();
    const bool has_mapped = processQueue();
    if (has_mapped) handleMessages();  // those that came meanwhile
    const std::vector<GridIndex> moved = kept_->update(config_, Clock::now(), hasTime(has_mapped));
    if (!moved.empty()) mapChanged(moved);
    if (corrected_ && corrected_->update(Clock::now())) status_publisher_.publish(status());
    queries_->map().releaseIfIdle();
    reportFault();
    diagnostics_->update([this] { return status(); }, [this] { return judgeAllPoints(); }, mapper_->config());
  }
}

void MappingServer::handleMessages() {
  // The limit keeps a flood of messages from starving the mapper.
  for (int n = 0; n < 1000 && !queue_.isEmpty(); ++n) queue_.callOne();
}

void MappingServer::onCloud(std::size_t input, const CloudEvent& event) {
  const sensor_msgs::PointCloud2ConstPtr& cloud = event.getConstMessage();
  const auto now = Clock::now();
  checkClock();
  const ros::Time& stamp = cloud->header.stamp;
  if (time_watch_.stampsWentBack(input, stamp)) onTimeJump(stamp, "the stamps of clouds went back");
  ledger_.received(now);
  if (paused_)
    return drop({cloud, input, now}, DropReason::kPaused, "mapping is paused; call ~resume to go on");
  // Latency counts from the reception: the cloud may have waited in queue_ while a scan was mapped.
  const std::chrono::duration<double> since(
      secondsSince(event.getReceiptTime(), ros::Time::now(), ros::Time::isSimTime()));
  const auto received = now - std::chrono::duration_cast<Clock::duration>(since);
  const auto most = static_cast<std::size_t>(config_.queue_size);
  if (const auto given_up = waiting_.push({cloud, input, received}, most, config_.queue_policy)) {
    drop(*given_up, DropReason::kQueueFull,
         "queue_size " + std::to_string(config_.queue_size) +
             " is reached: clouds come faster than they are mapped, or wait for transforms; use a faster "
             "free_space/mode, a coarser resolution or fewer clouds, or check tf");
  }
}

bool MappingServer::processQueue() {
  const auto now = Clock::now();
  const auto next = waiting_.takeIf([&](WaitingCloud& waiting) {
    const std::chrono::duration<double> waited = now - waiting.received;
    return waited.count() >= config_.tf_timeout ||
           readers_[waiting.input].ready(*waiting.cloud, *poses_, waiting.times);
  });
  if (!next) return false;
  {
    const Gate::Closed corrector_waits(kept_->corrector() ? kept_->corrector()->gate() : nullptr);
    map(*next);
  }
  return true;
}

bool MappingServer::hasTime(bool has_mapped) {
  const auto now = Clock::now();
  const bool has_time = (has_mapped && waiting_.size() == 0) || now - had_time_ > kNoTimeAtMost;
  if (has_mapped && has_time) had_time_ = now;
  return has_time;
}

void MappingServer::map(const WaitingCloud& waiting) {
  const Remedies remedies{" (waited tf_timeout " + numberText(config_.tf_timeout) + " s)",
                          "; or set window or map_file, or call ~reset"};
  const auto refused =
      mapCloud(*waiting.cloud, readers_[waiting.input], *poses_, ros::Time::now(), mapper_->map().geometry(),
               remedies, [&](const PlacedScan& placed) { integrate(waiting, placed); });
  if (refused) drop(waiting, refused->reason, refused->why);
}

void MappingServer::integrate(const WaitingCloud& waiting, const PlacedScan& placed) {
  const ScanStats stats = addToMap(waiting, placed);
  const std_msgs::Header& header = waiting.cloud->header;
  const auto now = Clock::now();
  ledger_.integrated(header, stats, std::chrono::duration<double>(now - waiting.received).count(), now);
  ledger_.unlistedLabels(placed.unlisted_labels);
  points_[waiting.input].add(stats.counts, placed.unlisted_labels);
  sayOfInput(waiting, placed, stats.counts);
  poses_->watchJumps(config_.frame_id, readers_[waiting.input].sensorFrame(*waiting.cloud),
                     ros::Time().fromNSec(placed.scan.stamp));
  map_stamp_ = header.stamp;
  sensor_ = placed.scan.origin;
  warnOfFarPlace();
  trajectory_.append({header.stamp, toPose(placed.T_map_sensor)}, mapper_->config().resolution);
  if (config_.window > 0.0) {
    trajectory_.keepWithin(sensor_, config_.window + mapper_->map().geometry().blockSize());
  }
  publishing_->changed(mapper_->touchedBlocks());
  mapChanged(kept_->addScan(placed.scan.stamp, sensor_, config_));
  status_publisher_.publish(status());
}

void MappingServer::sayOfInput(const WaitingCloud& waiting, const PlacedScan& placed,
                               const PointCounts& counts) {
  InputNotes& notes = notes_[waiting.input];
  const InputSentences sentences = notes.ofScan(*waiting.cloud, placed, counts, readers_[waiting.input],
                                                mapper_->classes(), mapper_->config());
  for (const std::string& sentence : sentences.warnings) ROS_WARN("%s", sentence.c_str());
  for (const std::string& sentence : sentences.notes) ROS_INFO("%s", sentence.c_str());
  points_[waiting.input].label_remedy = notes.labelRemedy();
}

void MappingServer::warnOfFarPlace() {
  if (warned_of_far_place_) return;
  const std::string warning = farFromOriginWarning(sensor_, mapper_->config().resolution, config_.frame_id);
  if (warning.empty()) return;
  warned_of_far_place_ = true;
  ROS_WARN("%s", warning.c_str());
}

void MappingServer::reportTfJumps() {
  for (const TfJump& jump : poses_->takeJumps()) {
    ledger_.tfJumped();
    if (corrected_) corrected_->noteJump(jump.stamp);
    if (!throttle_.allow(shortText(jump.parent) + " " + shortText(jump.child), Clock::now())) continue;
    ROS_WARN("%s; %s", sentenceOf(jump).c_str(),
             corrected_ ? "the map follows the corrected poses on corrected_path"
                        : "set journal and publish the corrected poses on corrected_path, or call ~reset");
  }
}

ScanStats MappingServer::addToMap(const WaitingCloud& waiting, const PlacedScan& placed) {
  if (!corrected_) return addToMap(placed.scan);
  RoundedScan rounded = corrected_->round(placed);
  place(rounded.scan, rounded.T_map_sensor, rounded_);
  ScanStats stats = addToMap(rounded_);
  stats.counts += rounded.left_out;
  corrected_->add(std::move(rounded.scan), rounded.T_map_sensor,
                  readers_[waiting.input].sensorFrame(*waiting.cloud), mapper_->touchedBlocks());
  kept_->nameSensors(corrected_->sensorFrames());
  return stats;
}

ScanStats MappingServer::addToMap(const Scan& scan) {
  try {
    return mapper_->integrate(scan);
  } catch (const ScanRefused& refused) {
    if (refused.reason() != ScanRefused::Reason::kMemory || !kept_->makeRoom()) throw;
  }
  return mapper_->integrate(scan);
}

void MappingServer::reportFault() {
  const std::string fault = kept_->fault();
  if (fault == last_fault_) return;
  if (fault.empty()) {
    ROS_INFO("%s is in order again", config_.map_file.c_str());
  } else {
    ROS_ERROR("%s", fault.c_str());
  }
  last_fault_ = fault;
  status_publisher_.publish(status());
}

void MappingServer::checkClock() {
  if (time_watch_.clockWentBack()) onTimeJump(ros::Time::now(), "/clock went back");
}

void MappingServer::onTimeJump(const ros::Time& new_time, const std::string& what) {
  ledger_.timeJumped();
  time_watch_.restart();
  poses_->restart(new_time);
  const auto of_old_time = [&](const WaitingCloud& waiting) {
    return waiting.cloud->header.stamp.toSec() > new_time.toSec() + TimeWatch::kOutOfOrder;
  };
  std::size_t waited = 0;
  for (; const auto waiting = waiting_.takeIf(of_old_time); ++waited) {
    drop(*waiting, DropReason::kTimeJump, "time jumped back while it waited");
  }
  const bool forget = config_.on_time_jump == OnTimeJump::kReset;
  if (forget) reset();
  ROS_WARN(
      "Time jumped back (%s): old transforms and %lu waiting clouds are dropped, the map is %s "
      "(on_time_jump)",
      what.c_str(), waited, forget ? "reset" : "kept");
}

void MappingServer::drop(const WaitingCloud& cloud, DropReason reason, const std::string& why) {
  const std_msgs::Header& header = cloud.cloud->header;
  ledger_.dropped(header, reason, why);
  const std::string topic = cloud_subscribers_[cloud.input].getTopic();
  if (throttle_.allow(topic + why, Clock::now())) {
    ROS_WARN("Dropped the cloud of %s of time %.3f: %s", topic.c_str(), header.stamp.toSec(), why.c_str());
  }
  status_publisher_.publish(status());
}

Health MappingServer::judgeAllPoints() {
  Health all;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Health one = judgePoints(points_[i], cloud_subscribers_[i].getTopic(), readers_[i].input(),
                                   mapper_->config(), mapper_->classes().name());
    points_[i] = {};
    if (one.message.empty()) continue;
    all.level = std::max(all.level, one.level);
    all.message += (all.message.empty() ? "" : "; ") + one.message;
    if (throttle_.allow(one.message, Clock::now())) ROS_WARN("%s", one.message.c_str());
  }
  return all;
}

MappingStatus MappingServer::status() {
  MappingStatus status = ledger_.status(Clock::now(), waiting_.size());
  status.paused = paused_;
  status.correction_done_around = status.correction_done = true;
  if (corrected_) corrected_->fill(status);
  if (live_settings_) status.last_refusal = live_settings_->lastRefusal();
  status.blocks = static_cast<std::uint32_t>(mapper_->map().size());
  status.map_bytes = mapper_->mapBytes();
  status.read_only = kept_->readOnly();
  status.map_file_fault = kept_->fault();
  status.map_saved = ros::Time(kept_->saved().sec, kept_->saved().nsec);
  return status;
}

void MappingServer::mapChanged(const std::vector<GridIndex>& blocks) {
  publishing_->changed(blocks);
  queries_->map().changed();
}

void MappingServer::wholeMapChanged() {
  publishing_->startOver();
  queries_->map().changed();
}

std_msgs::Header MappingServer::mapHeader() const {
  std_msgs::Header header;
  header.frame_id = config_.frame_id;
  header.stamp = map_stamp_;
  return header;
}

ServerSnapshot MappingServer::snapshot() {
  return {mapper_->snapshot(),      mapHeader(), mapper_->classes(), trajectory_.poses(), config_, sensor_,
          mapper_->config().threads};
}

std::shared_ptr<const ServerSnapshot> MappingServer::askForSnapshot() {
  return QueuedCall<std::shared_ptr<const ServerSnapshot>>::ask(
      queue_, [this] { return std::make_shared<const ServerSnapshot>(snapshot()); });
}

std::shared_ptr<void> startMappingServer(const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
  return std::make_shared<MappingServer>(node, private_node);
}

}  // namespace bki_mapping::ros_interface
