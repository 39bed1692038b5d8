"""Between the topics of the contract and the data of the mathematics.

`reading`, `reading_sensors`, `reading_path` and `references` make data of messages, and check them;
`writing`, `writing_sensors` and `drawing` make messages of data. Wheels are (right, left) in data
and (left, right) in messages: here their order changes. Nodes and topics are named in `topics`,
frames and joints in `names`; `cdr_layout` makes the bytes of a message one row of numbers, which
`in_place` reads and writes.
"""
