"""What an independent reader finds in an MCAP is the recorded cast, in types that the file itself describes."""

import io

import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.exchange import mcap_file
from wam_cast.motion.stages import Stage

pytest.importorskip("mcap_protobuf", reason="the extra `mcap` is not installed")

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

EVERY_SAMPLE = ("/joint_states", "/ball", "/ball_velocity", "/hand", "/hand_desired")


@pytest.fixture(scope="module")
def content(recording):
    return mcap_file.mcap_content([recording, recording])


@pytest.fixture(scope="module")
def messages(content):
    """Return by topic the log times [ns] and decoded messages, by the description that the file carries."""
    found = {}
    reader = make_reader(io.BytesIO(content), decoder_factories=[DecoderFactory()])
    for _, channel, message, decoded in reader.iter_decoded_messages():
        found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def of_first(messages, topic, recording):
    """Return the messages of the first of the two casts."""
    last = round(1e9 * recording.times[-1])
    n = len(recording.times) if topic in EVERY_SAMPLE else sum(time < last for time, _ in messages[topic])
    return messages[topic][:n]


def xyz(point):
    return [point.x, point.y, point.z]


def test_channels_have_names_and_foxgloves_types(content):
    summary = make_reader(io.BytesIO(content)).get_summary()
    types = {c.topic: (summary.schemas[c.schema_id].name, c.message_encoding) for c in summary.channels.values()}
    assert types == {
        "/joint_states": ("foxglove.JointStates", "protobuf"),
        "/ball": ("foxglove.PoseInFrame", "protobuf"),
        "/ball_velocity": ("foxglove.Vector3", "protobuf"),
        "/hand": ("foxglove.PoseInFrame", "protobuf"),
        "/hand_desired": ("foxglove.PoseInFrame", "protobuf"),
        "/tf": ("foxglove.FrameTransforms", "protobuf"),
        "/scene": ("foxglove.SceneUpdate", "protobuf"),
        "/log": ("foxglove.Log", "protobuf"),
    }


def test_numbers_are_those_of_the_recording(recording, messages):
    n_q = recording.states.shape[1] // 2
    joints = of_first(messages, "/joint_states", recording)
    np.testing.assert_array_equal([time for time, _ in joints], np.round(1e9 * recording.times))
    for name, expected in (
        ("position", recording.states[:, :7]),
        ("velocity", recording.states[:, n_q : n_q + 7]),
        ("effort", recording.torques),
    ):
        found = [[getattr(joint, name) for joint in one.joints] for _, one in joints]
        np.testing.assert_array_equal(found, expected)
    assert [joint.name[:2] for joint in joints[0][1].joints] == [f"j{i}" for i in range(1, 8)]
    for topic, expected in (
        ("/ball", recording.p_WL),
        ("/hand", recording.p_WE),
        ("/hand_desired", recording.p_WE_desired),
    ):
        found = of_first(messages, topic, recording)
        np.testing.assert_array_equal([xyz(one.pose.position) for _, one in found], expected)
        assert found[5][1].timestamp.ToNanoseconds() == found[5][0]
        assert found[5][1].frame_id == "world"
    velocities = of_first(messages, "/ball_velocity", recording)
    np.testing.assert_array_equal([xyz(one) for _, one in velocities], recording.v_WL)


def test_frames_and_scene_are_where_the_bodies_are(recording, messages):
    poses = of_first(messages, "/tf", recording)
    assert len(poses) == pytest.approx(50 * recording.times[-1], abs=2)
    for time, one in (poses[0], poses[-1]):
        sample = int(np.argmin(np.abs(recording.times - time / 1e9)))
        places = {t.child_frame_id: xyz(t.translation) for t in one.transforms}
        assert {"base", "link7", "tool_plate", "ball"} <= set(places)
        np.testing.assert_allclose(places["tool_plate"], recording.p_WE[sample], atol=1e-9)
        np.testing.assert_allclose(places["ball"], recording.p_WL[sample], atol=1e-9)
        for t in one.transforms:
            r = t.rotation
            assert r.x**2 + r.y**2 + r.z**2 + r.w**2 == pytest.approx(1.0)
    (_, cup), (_, first), *_ = messages["/scene"]
    assert [entity.id for entity in cup.entities] == ["cup"]
    cylinder = cup.entities[0].cylinders[0]
    np.testing.assert_allclose(xyz(cylinder.pose.position)[:2], recording.cup)
    assert cylinder.pose.position.z + cylinder.size.z / 2 == pytest.approx(recording.scenario.cup.rim_height)
    entities = {entity.id: entity for entity in first.entities}
    string = np.array([xyz(point) for point in entities["string"].lines[0].points])
    np.testing.assert_allclose(string[0], recording.p_WE[0], atol=1e-9)
    np.testing.assert_allclose(xyz(entities["ball"].spheres[0].pose.position), recording.p_WL[0], atol=1e-9)


def test_stages_and_outcome_are_told_and_casts_follow_each_other(recording, messages):
    lines = [(one.name, one.message) for _, one in messages["/log"]]
    stages = [("stage", Stage(stage).name.lower()) for stage in dict.fromkeys(recording.stages.tolist())]
    assert lines == 2 * [*stages, ("outcome", "caught")]
    times = [time for time, _ in messages["/ball"]]
    n = len(recording.times)
    assert len(times) == 2 * n
    assert times[n] == times[n - 1] == round(1e9 * recording.times[-1])
    assert np.all(np.diff(times) >= 0)


def test_what_was_cast_gives_back_the_numbers(recording, content):
    reader = make_reader(io.BytesIO(content))
    kept = {one.name: one.metadata for one in reader.iter_metadata()}
    assert set(kept) == {"cast 1", "cast 2"}
    first = kept["cast 1"]
    assert float(first["distance"]) == recording.cast.distance
    assert (float(first["cup_x"]), float(first["cup_y"])) == recording.cup
    assert [float(first[f"landing_{axis}"]) for axis in "xy"] == recording.outcome.landing.tolist()
    attached = {one.name: one.data.decode() for one in reader.iter_attachments()}
    assert attached["scenario.yaml"] == recording.scenario.to_yaml()
    assert "j4_elbow_pitch" in attached["arm.urdf"]


def test_another_name_or_a_missing_package_is_one_line(tmp_path, recording, monkeypatch):
    with pytest.raises(InputError, match=r"choose a name that ends in \.mcap"):
        mcap_file.write_mcap(recording, tmp_path / "cast.bag")
    monkeypatch.setattr(mcap_file, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install \"wam_cast\[mcap\]\""):
        mcap_file.write_mcap(recording, tmp_path / "cast.mcap")
    assert not list(tmp_path.iterdir())
