from setuptools import setup

PACKAGE = "palpate_ros2"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Recognises by touch which known object lies where, with Palpate",
    license="Apache-2.0",
    packages=[PACKAGE],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", ["launch/recognise.launch.py"]),
    ],
    install_requires=["setuptools", "numpy", "palpate"],
    zip_safe=True,
    entry_points={"console_scripts": [f"recognise = {PACKAGE}.node:main"]},
)
