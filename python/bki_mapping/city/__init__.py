"""A map of a city from many drives, made by the programs of this package on any number of machines.

Maps are sums, so drives are mapped in pieces, and the pieces are summed by regions, in any order and on any machine; the city
is the same, to the bit, as if one run had mapped every scan. Dask says which process does what, and repeats what fails; only
names of files pass through it. docs/city.md explains the program map_city; the steps are

    description.py   what a city is made of: a YAML file
    plan.py          its pieces and regions, and the files that they are in
    work.py          the tasks: count the clouds of a bag, map a piece, sum a region, check it
    build.py         gives the tasks to Dask, and follows them
    report.py        what people read: progress, a report and a picture
"""
