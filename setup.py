from glob import glob

from setuptools import find_packages, setup

package_name = "climber_uk"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(include=[package_name, f"{package_name}.*"]),
    package_data={package_name: ["py.typed", "ros/*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
        (f"share/{package_name}/config", glob("config/*")),
        (f"share/{package_name}/launch", glob("launch/*.launch.py")),
        (f"share/{package_name}/urdf", glob("urdf/*")),
        (f"share/{package_name}/examples", glob("examples/*.py")),
    ],
    python_requires=">=3.11",
    install_requires=["setuptools", "numpy", "scipy", "pyyaml"],
    extras_require={
        # rclpy and the messages, where no ROS installation brings them
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        # bags and figures; never needed by the three nodes
        "analysis": ["rosbags>=0.11", "mcap>=1.6", "matplotlib", "tqdm", "zstandard", "lz4"],
        # campaigns of many runs, and to have them run on a Dask cluster
        "campaign": ["pyarrow", "matplotlib", "tqdm"],
        "cluster": ["distributed"],
        # thousands of closed loops at once, their plants compiled
        "fast": ["numba"],
        # the same on all of an accelerator, or faster on a CPU
        "accelerator": ["jax"],
        # examples/mujoco_driver.py: a climber of other physics
        "physics": ["mujoco"],
        # completion of the command `climber` in shells
        "completion": ["argcomplete"],
        "test": ["pytest<9", "pytest-timeout", "pytest-xdist", "hypothesis", "evo", "coverage"],
    },
    zip_safe=False,
    maintainer="The climber_uk maintainers",
    maintainer_email="maintainers@climber-uk.org",
    description="Udwadia-Kalaba torque control of a wheeled wall-climbing robot for ROS 2 Jazzy",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            f"{executable} = {package_name}.executables:{module}"
            for executable, module in {
                "trajectory_publisher": "nodes.trajectory_publisher",
                "uk_torque_controller": "nodes.uk_torque_controller",
                "plant_simulator": "nodes.plant_simulator",
                "wall_odometry": "nodes.wall_odometry",
                "markers": "nodes.markers",
                "record_bag": "recording.record_bag",
                "run_demo": "demo.run_demo",
                "check_driver": "driver_check.check_driver",
                "analyze_bag": "report.analyze_bag",
                "compare_bags": "report.compare_bags",
                "identify": "identification.identify",
                "replay_controller": "replay.replay_controller",
                "animate_bag": "report.animate_bag",
                "export_tum": "report.export_tum",
                "localize": "replay.localize",
                "reproduce_paper": "paper.reproduce_paper",
                "campaign": "campaign.command",
                "climber": "operating.command",
                "check_path": "path_check.check_path",
            }.items()
        ]
    },
)
